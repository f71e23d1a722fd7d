// SPDX-License-Identifier: Apache-2.0
// Whole poses, settled once and kept in a calibrated model.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include <ecorche/preprocess/stage_store.hpp>
#include <ecorche/values/model.hpp>
#include "app/program.hpp"
#include "preprocess/correct/pose_places.hpp"

namespace ecorche::app {

/// `names`: pose files, or lib:NAME; without any, all of the library that the rig has the joints of. Throws
/// as io::read_pose and io::library_pose do.
std::vector<correct::WholePose> whole_poses(const Program& program, const std::vector<std::string>& names,
                                            const Rig& rig);

/// Settles `model`, corrected as it is, at each of `poses`, one after the other, and adds what that moves to
/// its pose_corrections; what `store`, which may be null, has of an earlier run is not settled again. Returns
/// a row for each: its name, places, nodes, the largest move in mm, whether it passed before, and passes with
/// all that is kept.
nlohmann::json add_whole_poses(const Program& program, std::span<const correct::WholePose> poses,
                               const std::shared_ptr<Model>& model, preprocess::StageStore* store);

}  // namespace ecorche::app
