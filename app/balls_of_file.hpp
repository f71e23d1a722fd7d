// SPDX-License-Identifier: Apache-2.0
// A skeleton file's balls, posed by a rig that is named apart.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>
#include "app/program.hpp"
#include "runtime/spheres/balls.hpp"
#include "runtime/spheres/seams.hpp"

namespace ecorche::app {

/// The rig of a skeleton file (.yaml) whose every centre is given, or of a model (.hdf). Throws as the
/// readers do; Error{config} for a joint without its centre.
Rig read_placed_rig(const std::filesystem::path& path);

/// A skeleton by itself (.vtp), or the first of a model (.hdf); and the rig that moves it: of `rig`, a
/// skeleton file whose every centre is given (.yaml) or a model, else of the model that the skeleton came
/// from, else empty. With a rig the voxels hang on its rows, matched by the names of segments, and its joints
/// are where the file has them, if it does. Throws as the
/// readers do; Error{config} for a joint without its centre, a segment that the rig lacks, a model without
/// spheres; Error{data} for a skeleton that hangs on no segments although a rig is given.
std::pair<VolumetricSkeleton, Rig> read_skeleton_and_rig(const std::filesystem::path& skeleton,
                                                         const std::filesystem::path& rig);

/// Its balls at `pose` (within limits, coupled), bridged along `seams`; `clamped` counts the joints that
/// limits held back.
runtime::BallSet posed_balls(const VolumetricSkeleton& skeleton, const ImageGrid& lattice, const Rig& rig,
                             Pose pose, const runtime::Seams& seams, std::size_t& clamped);

/// A skeleton, the rig that moves it, and its balls in `pose` (a file, or lib:NAME), at rest without one.
struct PlacedBalls {
  VolumetricSkeleton skeleton;
  Rig rig;
  runtime::BallSet set;
};

/// Throws as read_skeleton_and_rig and read_frames do; Error{usage} for a pose without a rig.
PlacedBalls read_placed_balls(const Program& program, const std::filesystem::path& skeleton,
                              const std::filesystem::path& rig, const std::string& pose);

}  // namespace ecorche::app
