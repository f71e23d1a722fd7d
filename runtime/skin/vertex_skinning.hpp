// SPDX-License-Identifier: Apache-2.0
// What somebody else needs to skin the tissues: segments, weights and centres folded from the nodes of the
// tets to the vertices.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/quantise_box.hpp>
#include <ecorche/values/pose.hpp>

namespace ecorche::runtime {

/// Skinned by itself. Numbers of `VertexSkinning::box`; weights in 65535ths, the heaviest first, of sum
/// 65535; segment 0 where a weight is 0.
struct SkinPoint {
  static constexpr std::size_t most = 8;
  std::array<std::uint16_t, 3> rest{}, centre{};
  std::array<std::uint16_t, most> segment{}, weight{};
};

/// A vertex that its own weights do not move well enough: it hangs on the four nodes of its tet instead, as
/// on the server.
struct HungVertex {
  std::uint32_t vertex = 0;
  std::array<std::uint32_t, 4> node{};  ///< rows of TissueSkinning::nodes
  std::array<float, 4> share{};         ///< barycentric, signed outside the mesh
};

struct TissueSkinning {
  std::uint32_t tissue = 0;
  std::uint32_t influences = 1;  ///< of each point that count: 1 (a bone), 4 or 8
  std::vector<SkinPoint>
      vertices;  ///< one per vertex; those of `hung` are not to be used, but for their rest
  std::vector<SkinPoint> nodes;
  std::vector<HungVertex> hung;  ///< ascending
};

/// Beside the body that BodyPoser makes of the same pose.
struct SkinningError {
  double largest_mm = 0;
  double largest_turn = 0;  ///< radians, of a normal
  double usual_turn = 0;    ///< radians, which 99 of 100 normals of a pose stay below in every pose
};

/// The numbers of all tissues of a model.
QuantiseBox skinning_box(const Model& model);

/// A vertex is folded to 4 influences, else to 8, where that keeps it within this of the body in every pose
/// of `poses` and by every method; else it is hung on nodes.
inline constexpr double fold_error_mm = 0.5;

/// Of `tissues`, in their order. `error`: what is left over `poses`, by all methods, quantising included.
/// About 150 bytes a vertex on the way; threads of the caller's arena.
std::vector<TissueSkinning> fold_to_vertices(const BodyPoser& poser, std::span<const std::uint32_t> tissues,
                                             std::span<const Pose> poses, SkinningError& error);

/// Every joint of a rig turned halfway to its limits, one way and the other: poses of a library leave out
/// joints.
std::vector<Pose> halfway_poses(const Skeleton& skeleton);

}  // namespace ecorche::runtime
