// SPDX-License-Identifier: Apache-2.0
// The token that clients show and servers ask for.
#pragma once

#include <string>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"

namespace ecorche::app {

/// The one line of the file, without the blanks around it. Throws Error{config} for an empty file or several
/// lines, and what reading throws.
inline std::string read_token(const std::string& path) {
  const std::string text = files::read_text(path, 4096);
  const auto first = text.find_first_not_of(" \t\r\n");
  const auto last = text.find_last_not_of(" \t\r\n");
  std::string token = first == std::string::npos ? std::string() : text.substr(first, last - first + 1);
  if (token.empty() || token.find_first_of(" \t\r\n") != std::string::npos)
    throw Error(ErrorKind::config, path, "does not hold one token", "write one line without blanks to it");
  return token;
}

}  // namespace ecorche::app
