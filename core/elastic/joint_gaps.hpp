// SPDX-License-Identifier: Apache-2.0
// What holds the nodes of a model, and which tets lie between bones that move against each other.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::elastic {

/// By node: the segment whose bone holds it, else -1. Held are the nodes of tets with a bone's label.
std::vector<std::int32_t> held_by(const Model& model);

/// 1 for each soft tet with corners on bones of two segments or more, `held_by` as above; empty where no tet
/// is such. It lies in a joint's gap, one tet apart, where bones slide past one another: of no size and shape
/// could it keep its volume (of a ball that turns in its socket by a right angle, points at its sides come to
/// lie behind the planes of the socket's triangles that they faced).
std::vector<std::uint8_t> joint_gaps(const Model& model, const std::vector<std::int32_t>& held_by);

}  // namespace ecorche::elastic
