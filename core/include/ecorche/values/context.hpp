// SPDX-License-Identifier: Apache-2.0
// What a stage may ask of the outside world: progress, a stop request, a log. Nothing else.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include <ecorche/values/error.hpp>

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
  /// Runs work that cannot be asked to stop (a factorization in a foreign library); empty: the caller runs
  /// it. A program that must end at once on a stop may throw Error{interrupted} here and leave it running:
  /// such work owns all that it touches (shared pointers captured by value), never the caller's references.
  std::function<void(std::function<void()> work)> run_apart = {};

  /// How far the stage has come, 0 to 1.
  void report(double fraction) const {
    if (progress) progress(fraction);
  }
  /// Tells the log.
  void info(std::string_view line) const {
    if (log) log(LogLevel::info, line);
  }
  /// Tells the log, as a warning.
  void warn(std::string_view line) const {
    if (log) log(LogLevel::warning, line);
  }
  /// Runs `work` where `run_apart` says, and waits for it; rethrows what it throws.
  void run_unstoppable(std::function<void()> work) const {
    check_stop();
    if (run_apart) return run_apart(std::move(work));
    work();
  }
  /// The same without a voice: for what is only part of a stage.
  Context quiet() const {
    Context out;
    out.stop = stop;
    out.run_apart = run_apart;
    return out;
  }
  /// Throws Error{interrupted} once a stop was requested.
  void check_stop() const {
    if (stop.stop_requested()) throw Error(ErrorKind::interrupted, "ecorche", "interrupted", "run it again");
  }
};

}  // namespace ecorche
