// SPDX-License-Identifier: Apache-2.0
// Where skinning about centres of rotation puts a node, and how it turns it: double precision, node by node.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <span>

#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::correct {

struct SkinnedNode {
  Eigen::Vector3d at;       ///< mm
  Eigen::Quaterniond turn;  ///< of the blended quaternion: the frame that corrections are stored in
};

/// LeHodgins16; Sujar18 4: what runtime/skin does in float32. `segments`: motions from rest, signs fixed down
/// the tree (kinematics::forward).
SkinnedNode skin_node(const Model& model, std::size_t node, std::span<const RigidTransform> segments);

}  // namespace ecorche::correct
