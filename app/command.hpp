// SPDX-License-Identifier: Apache-2.0
// What every subcommand shares: options of the whole program, the console, the stop request.
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>

#include <ecorche/values/context.hpp>

// What help calls a file or a folder.
template <>
constexpr const char* CLI::detail::type_name<std::filesystem::path>() {
  return "PATH";
}

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

/// Declares a subcommand on `app`; its callback stores what it must run into `chosen` and returns the exit
/// code.
using Run = std::function<int()>;
using Declare = void (*)(CLI::App& app, Program& program, Run& chosen);

// One file per subcommand: app/phantom.cpp, ...
void declare_phantom(CLI::App& app, Program& program, Run& chosen);
void declare_new(CLI::App& app, Program& program, Run& chosen);
void declare_check(CLI::App& app, Program& program, Run& chosen);
void declare_repair(CLI::App& app, Program& program, Run& chosen);
void declare_preprocess(CLI::App& app, Program& program, Run& chosen);
void declare_info(CLI::App& app, Program& program, Run& chosen);
void declare_verify(CLI::App& app, Program& program, Run& chosen);
void declare_export(CLI::App& app, Program& program, Run& chosen);
void declare_pose(CLI::App& app, Program& program, Run& chosen);
void declare_motion(CLI::App& app, Program& program, Run& chosen);
void declare_unpose(CLI::App& app, Program& program, Run& chosen);
void declare_probe(CLI::App& app, Program& program, Run& chosen);
void declare_serve(CLI::App& app, Program& program, Run& chosen);
void declare_stream(CLI::App& app, Program& program, Run& chosen);
void declare_thin(CLI::App& app, Program& program, Run& chosen);
void declare_refill(CLI::App& app, Program& program, Run& chosen);
void declare_rig(CLI::App& app, Program& program, Run& chosen);
void declare_tears(CLI::App& app, Program& program, Run& chosen);
void declare_deformers(CLI::App& app, Program& program, Run& chosen);
void declare_path(CLI::App& app, Program& program, Run& chosen);
void declare_radiograph(CLI::App& app, Program& program, Run& chosen);
void declare_fem(CLI::App& app, Program& program, Run& chosen);
void declare_calibrate(CLI::App& app, Program& program, Run& chosen);
void declare_contact(CLI::App& app, Program& program, Run& chosen);
void declare_cohort(CLI::App& app, Program& program, Run& chosen);
void declare_report(CLI::App& app, Program& program, Run& chosen);
void declare_igtl(CLI::App& app, Program& program, Run& chosen);

}  // namespace ecorche::app
