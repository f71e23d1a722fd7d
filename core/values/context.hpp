// SPDX-License-Identifier: Apache-2.0
// What a stage may ask of the outside world: progress, a stop request, a log. Nothing else.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <string_view>

#include "core/values/error.hpp"

namespace ecorche {

enum class LogLevel { info, warning };

/// Handed by reference to every stage; the default one is silent and never stops.
struct Context {
  /// Called with the part of the current stage that is done, 0 to 1; may be empty.
  std::function<void(double fraction)> progress;
  /// Called with one line without a line break; may be empty.
  std::function<void(LogLevel level, std::string_view line)> log;
  /// Set by Ctrl-C. Stages look at it at least ten times a second.
  std::stop_token stop;

  void report(double fraction) const {
    if (progress) progress(fraction);
  }
  void info(std::string_view line) const {
    if (log) log(LogLevel::info, line);
  }
  void warn(std::string_view line) const {
    if (log) log(LogLevel::warning, line);
  }
  /// Throws Error{interrupted} once a stop was requested.
  void check_stop() const {
    if (stop.stop_requested()) throw Error(ErrorKind::interrupted, "ecorche", "interrupted", "run it again");
  }
};

}  // namespace ecorche
