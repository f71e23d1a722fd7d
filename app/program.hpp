// SPDX-License-Identifier: Apache-2.0
// What every subcommand shares: options of the whole program, the console, the stop request.
#pragma once

#include <atomic>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <string>
#include <string_view>

#include <ecorche/values/context.hpp>

namespace ecorche::app {

/// Options of the whole program and the way to speak: results on stdout, everything else on stderr.
struct Program {
  bool json = false;          ///< exactly one JSON object on stdout
  int threads = 0;            ///< 0: all cores; main runs the command in one TBB arena of that size
  bool fail_on_warn = false;  ///< main then turns 0 into 1 where anything was warned of
  std::stop_token stop;       ///< set by SIGINT and SIGTERM

  /// A context for one stage that draws `label` with a bar and an ETA on a terminal, plain lines otherwise.
  Context context(std::string label) const;
  /// A line on stderr; one that begins with `warning: ` is a warning.
  void note(std::string_view line) const;
  /// Something was warned of, in a result: contexts and notes say so by themselves.
  void warn() const { *warned_ = true; }
  bool warned() const { return *warned_; }
  /// The result: `object` on stdout under --json, else `text`. `ok` is true where the object does not say.
  void result(const std::string& text, const nlohmann::json& object) const;

 private:
  std::shared_ptr<std::atomic<bool>> warned_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace ecorche::app
