// SPDX-License-Identifier: AGPL-3.0-or-later
// The `ecorche` command: chooses a subcommand, owns the one TBB arena, turns errors into lines and exit
// codes.
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <cstdio>
#include <exception>
#include <new>

#include "app/command.hpp"
#include "app/signals.hpp"

namespace ecorche::app {
namespace {

constexpr Declare kCommands[] = {declare_phantom, declare_check,  declare_repair,    declare_preprocess,
                                 declare_info,    declare_verify, declare_export,    declare_pose,
                                 declare_motion,  declare_unpose, declare_probe,     declare_thin,
                                 declare_refill,  declare_tears,  declare_deformers, declare_path,
                                 declare_contact, declare_serve,  declare_stream,    declare_rig};

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
  app.add_option("--threads", program.threads, "threads to use, 0: all cores")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  for (const Declare declare : kCommands) declare(app, program, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {  // --help, --version
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    throw Error(ErrorKind::usage, "command line", e.what(),
                "see ecorche --help, or ecorche SUBCOMMAND --help");
  }
  const int threads = program.threads > 0 ? program.threads : tbb::info::default_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  int code = 0;
  arena.execute([&] { code = chosen(); });
  return code;
}

int fail(const Error& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return exit_code(error.kind());
}

}  // namespace
}  // namespace ecorche::app

int main(int argc, char** argv) {
  using ecorche::Error;
  using ecorche::ErrorKind;
  try {
    return ecorche::app::run_command(argc, argv);
  } catch (const Error& error) {
    return ecorche::app::fail(error);
  } catch (const std::bad_alloc&) {
    return ecorche::app::fail(
        Error(ErrorKind::internal, "memory", "not enough memory", "use coarser voxels or fewer tets"));
  } catch (const std::exception& error) {
    return ecorche::app::fail(
        Error(ErrorKind::internal, "ecorche", error.what(), "this is a bug: report it with the command"));
  }
}
