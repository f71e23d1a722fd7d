// SPDX-License-Identifier: Apache-2.0
// A skeleton out of joints picked by hand: the IK skeleton of Gagvani01 4, where there is no rig yet.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>
#include "preprocess/thin/attach.hpp"
#include "preprocess/thin/mask.hpp"

namespace ecorche::thin {

struct Pick {
  std::string name;    ///< of its segment and its joint; empty: joint_01, joint_02, ... by its row
  std::string parent;  ///< another pick's name; empty: found along the tree
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< LPS mm
};

/// Moves every pick to the centre of the nearest skeletal voxel and makes a joint of it: balls about LPS
/// axes, without limits; the first is the root, and free. Picks that name no parent are
/// joined to the first one by one, always that one next whose link to a joined one is the shortest (a minimum
/// spanning tree): a straight line that stays in the object; where no line does, the way along the skeleton
/// tree. Segments come parents
/// first, else in the order of the picks. `moved` tells how far, in the order of the segments. `skeleton`
/// must have its tree (Error{internal}). Throws Error{config} for no picks, two of one name or on one voxel,
/// a parent that is no pick, parents in a ring, a first pick with a parent, and a pick that the tree does not
/// join to the first.
Skeleton skeleton_of_picks(const VolumetricSkeleton& skeleton, const Mask& mask,
                           const std::vector<Pick>& picks, std::vector<Snapped>& moved);

}  // namespace ecorche::thin
