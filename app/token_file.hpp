// SPDX-License-Identifier: Apache-2.0
// The token that clients show and servers ask for.
#pragma once

#include <string>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"

namespace ecorche::app {

/// The one line of the file, without the blanks around it. Throws Error{config} for an empty file or several
/// lines, and what reading throws.
inline std::string read_token(const std::string& path) {
  const std::string text = files::read_text(path, 4096);
  const std::vector<std::string_view> words = text::words(text);
  if (words.size() != 1)
    throw Error(ErrorKind::config, path, "does not hold one token", "write one line without blanks to it");
  return std::string(words.front());
}

}  // namespace ecorche::app
