// SPDX-License-Identifier: Apache-2.0
// Tets of bones that can move rigidly with them, first of all tets (Sujar18 3.3: weights of 1 in all of a
// bone).
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::weights {

/// A bone whose tets keep less than this of its volume gets the corners back that other segments own: a bone
/// that is mostly contested, a kneecap between coarse tets, would follow no pose as itself.
inline constexpr double kKeptBone = 0.5;

/// A mesh whose tets of bones move rigidly.
struct RigidBones {
  TetMesh mesh;                          ///< tets of bones, then the contested ones, then the rest
  std::vector<std::uint16_t> contested;  ///< as Model::contested
};

/// A tet of a bone with a corner that another segment owns (bone_nodes) becomes soft: it is *contested*. What
/// remains has corners of one segment only, whose weights are 1, and moves rigidly by construction. Bones of
/// one segment contest nothing. Then tets of bones come first, since where posed tets overlap the lowest
/// index is drawn, then the contested ones, then all others; each class keeps the order that it came in. A
/// bone that keeps less than kKeptBone of its volume owns all of its corners then, the least first, and a
/// warning names what is still below. O(#T), and the nearest surface for contested corners.
RigidBones rigid_bones(TetMesh mesh, const Case& patient, const std::vector<std::int32_t>& bone_segment,
                       const Context& context);

}  // namespace ecorche::weights
