// SPDX-License-Identifier: AGPL-3.0-or-later
// The `ecorche` command: chooses a subcommand, owns the one TBB arena, turns errors into lines and exit
// codes.
#include <google/protobuf/stubs/logging.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <string_view>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/version.hpp>
#include "app/abandonable.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/command_line.hpp"
#include "app/signals.hpp"

namespace ecorche::app {
namespace {

constexpr Declare kCommands[] = {declare_phantom,    declare_new,        declare_check,  declare_repair,
                                 declare_preprocess, declare_info,       declare_verify, declare_export,
                                 declare_pose,       declare_motion,     declare_unpose, declare_probe,
                                 declare_thin,       declare_refill,     declare_tears,  declare_deformers,
                                 declare_path,       declare_contact,    declare_serve,  declare_stream,
                                 declare_rig,        declare_radiograph, declare_cohort, declare_report,
                                 declare_fem,        declare_calibrate,  declare_igtl};

int run_command(int argc, char** argv) {
  Program program;
  program.stop = stop_on_signals();
  Run chosen;
  CLI::App app{
      "ecorche poses a patient's whole anatomy. For training and education, not for planning surgery.",
      "ecorche"};
  app.require_subcommand(1);
  app.set_version_flag("--version", ECORCHE_VERSION);
  app.fallthrough();
  app.add_flag("--json", program.json, "print exactly one JSON object on stdout");
  app.add_flag("--fail-on-warn", program.fail_on_warn,
               "exit with 1, when all is written, where anything was warned of");
  app.add_option("--threads", program.threads, "threads to use, 0: all cores")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  for (const Declare declare : kCommands) declare(app, program, chosen);
  dress_help(app);
  try {
    parse(app, argc, argv);
  } catch (const CLI::Success& e) {  // --help, --version
    return app.exit(e);
  }
  const int threads = program.threads > 0 ? program.threads : tbb::info::default_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  int code = 0;
  arena.execute([&] { code = chosen(); });
  return code == 0 && program.fail_on_warn && program.warned() ? 1 : code;
}

// As results name it.
const char* kind_name(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage:
      return "usage";
    case ErrorKind::data:
      return "data";
    case ErrorKind::missing_input:
      return "missing_input";
    case ErrorKind::internal:
      return "internal";
    case ErrorKind::cannot_create:
      return "cannot_create";
    case ErrorKind::io:
      return "io";
    case ErrorKind::temporary:
      return "temporary";
    case ErrorKind::protocol:
      return "protocol";
    case ErrorKind::refused:
      return "refused";
    case ErrorKind::config:
      return "config";
    case ErrorKind::interrupted:
      return "interrupted";
  }
  return "internal";
}

// Before the command line is understood, or where it cannot be.
bool wants_json(int argc, char** argv) {
  return std::any_of(argv + 1, argv + argc,
                     [](const char* word) { return std::string_view(word) == "--json"; });
}

int fail(const Error& error, bool json) {
  std::fprintf(stderr, "error: %s\n", error.what());
  if (json) {
    const nlohmann::json object{{"ok", false},
                                {"error",
                                 {{"kind", kind_name(error.kind())},
                                  {"exit_code", exit_code(error.kind())},
                                  {"where", error.where()},
                                  {"what", error.problem()},
                                  {"mend", error.mend()}}}};
    std::puts(object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  }
  return exit_code(error.kind());
}

int exit_code_of(int argc, char** argv) {
  const bool json = wants_json(argc, argv);
  try {
    return run_command(argc, argv);
  } catch (const Error& error) {
    return fail(error, json);
  } catch (const std::bad_alloc&) {
    return fail(Error(ErrorKind::internal, "memory", "not enough memory", "use coarser voxels or fewer tets"),
                json);
  } catch (const std::exception& error) {
    return fail(
        Error(ErrorKind::internal, "ecorche", error.what(), "this is a bug: report it with the command"),
        json);
  }
}

}  // namespace
}  // namespace ecorche::app

int main(int argc, char** argv) {
  ecorche::model_file::leave_hdf5_open_at_exit();
  // What a peer sends that is no message is refused, and logged as all is; Protobuf would write lines of its
  // own.
  google::protobuf::SetLogHandler(nullptr);
  return ecorche::app::leave(ecorche::app::exit_code_of(argc, argv));
}
