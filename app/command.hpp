// SPDX-License-Identifier: Apache-2.0
// The subcommands, as main knows them.
#pragma once

#include <functional>

#include "app/cli_fwd.hpp"
#include "app/program.hpp"

namespace ecorche::app {

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
