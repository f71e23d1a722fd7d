// SPDX-License-Identifier: Apache-2.0
// From a pose to the rigid motion of every segment.
#pragma once

#include <span>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::kinematics {

/// The motion of every segment from the scanned rest pose, LPS mm: with A the joint's axes and c its centre,
///   local  = x -> A R(q) A' (x - c) + c + A t,     global = global(parent) * local,
/// so that the rest pose gives the identity everywhere. Quaternion signs are fixed down the tree (each child
/// has a non-negative dot product with its parent), so that blending never crosses hemispheres. `pose` must
/// have one rotation and one translation per joint (throws Error{internal}).
std::vector<RigidTransform> forward(const Rig& rig, const Pose& pose);

/// `forward` into storage of the caller: #segments transforms; allocates nothing.
void forward(const Rig& rig, const Pose& pose, std::span<RigidTransform> out);

}  // namespace ecorche::kinematics
