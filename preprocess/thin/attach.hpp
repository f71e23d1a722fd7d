// SPDX-License-Identifier: Apache-2.0
// Hanging skeletal voxels on the segments of a rig: the IK skeleton of Gagvani01 4.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/attachment.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>
#include "preprocess/thin/mask.hpp"

namespace ecorche::thin {

/// The centre of a skeletal voxel, LPS mm.
Eigen::Vector3d voxel_place(const VolumetricSkeleton& skeleton, std::size_t row);

/// Row of the skeletal voxel nearest to a place, LPS mm; the first in memory among equals. At least one
/// voxel.
std::size_t nearest_voxel(const VolumetricSkeleton& skeleton, const Eigen::Vector3d& to);

/// Whether the straight line between two places, LPS mm, stays in the object from behind `from` to `to`:
/// looked at every half voxel, nearest voxel centres.
bool line_inside(const Mask& mask, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// A joint that was moved.
struct Snapped {
  std::string joint;
  double moved_mm = 0;
};

/// Moves every joint's centre to the centre of its nearest_voxel.
std::vector<Snapped> snap_joints(const VolumetricSkeleton& skeleton, Skeleton& rig);

/// The joints whose nearest voxel is background, by name.
std::vector<std::string> joints_outside(const Mask& mask, const Skeleton& rig);

struct Attachment {
  std::vector<std::int32_t> segment;  ///< one a voxel, never none
  std::size_t near = 0;               ///< of the first pass
  std::size_t far_components = 0;     ///< without any voxel near a bone
};

/// The bones of the rig are the lines from every joint to the joints of its child segments; they belong to
/// the segment of the joint that they begin at. A segment without children is the point of its joint. A voxel
/// is near a bone when the straight line from its centre to the nearest point of the bone stays in the object
/// (looked at every half voxel, nearest voxel centres).
/// First pass: a voxel hangs on the nearest of the bones that it is near to, among equals on the one whose
/// segment comes last in the rig: what lies beyond the end of a bone goes to the child. Second pass: any
/// other voxel takes the segment of that first-pass voxel to which the way along the tree is shortest (mm,
/// centre to centre), the first in memory among equals. In a component without any, the deepest voxel takes
/// the nearest bone's first, wherever it lies. The mask is the one that was thinned; the skeleton must have
/// its tree (Error{internal}), the rig 1 to 65535 segments. O(voxels * bones).
Attachment attach(const VolumetricSkeleton& skeleton, const Mask& mask, const Skeleton& rig,
                  const Context& context);

/// Applies what the user says to `segment`. A split at a joint takes the voxels within `within_mm` of it that
/// hang on its segment or on the parent: those beyond the plane through the joint go to the segment, the
/// others to the parent. The plane's normal is halfway between the way in, from the parent's joint, and the
/// way out, to the mean of the children's joints (one of the two where there is no other). Returns the voxels
/// that changed. Throws Error{config} naming the joint or segment that is unknown, a split at the root, or
/// one whose way in and out give no plane.
std::size_t reassign(const VolumetricSkeleton& skeleton, const Skeleton& rig, const Reassignment& by_hand,
                     std::vector<std::int32_t>& segment);

}  // namespace ecorche::thin
