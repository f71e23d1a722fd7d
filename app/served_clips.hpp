// SPDX-License-Identifier: Apache-2.0
// The motion files of a folder as clips of a server.
#pragma once

#include <filesystem>
#include <vector>

#include <ecorche/values/skeleton.hpp>
#include "app/program.hpp"
#include "runtime/server/session/clip.hpp"

namespace ecorche::app {

/// Every motion file of the folder, in the order of their names, as poses of the rig; notes those that it
/// leaves out, which do not fit it or have more than 36000 frames. Throws Error{missing_input} for a folder
/// that is none, Error{config} for a file whose name is no identifier or stands there twice.
std::vector<server::Clip> read_clips(const Program& program, const std::filesystem::path& folder,
                                     const Rig& rig);

}  // namespace ecorche::app
