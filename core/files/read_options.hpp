// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>

#include <ecorche/files/budget.hpp>

namespace ecorche::files {

/// How a reader of foreign files is to read, and whom it tells what it had to change.
struct ReadOptions {
  ReadLimits limits;
  /// Called with one line that names the file; may be empty.
  std::function<void(std::string_view line)> note;

  void say(std::string_view line) const {
    if (note) note(line);
  }
};

}  // namespace ecorche::files
