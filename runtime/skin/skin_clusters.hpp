// SPDX-License-Identifier: Apache-2.0
// Skinning of tet nodes (Sujar18 4) by three methods, one vector kernel each.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include <ecorche/runtime/segment_motion.hpp>
#include "runtime/skin/corrections.hpp"
#include "runtime/skin/node_clusters.hpp"

namespace ecorche::runtime {

/// A job on some clusters of one body; owns nothing, allocates nothing.
struct SkinClusters {
  const NodeClusters& layout;
  std::span<const SegmentMotion> motions;  ///< #segments; every palette is below, which is not checked here
  RootMotion root;
  std::span<const std::uint32_t> clusters;  ///< which to skin; each below layout.clusters(), not checked here
  std::span<float> posed;                   ///< 3 * 64 * #clusters, LPS mm, a row a lane
  std::span<float> nodes;                   ///< empty, or 3 * #nodes: the same, a row a node of the model
  const Corrections* corrections = nullptr;  ///< of `layout`; null: there are none
  std::span<const float> modes = {};         ///< corrections->modes(), of the pose

  /// The first reason why a kernel must not be called; empty when it may.
  std::string_view check() const;
  /// x' = sum w_i M_i x. Loses volume where segments are far apart in turn. Weights enter on displacements,
  /// so that the rest pose is exact.
  void lbs() const;
  /// x' = b x b* with b = sum w_i q_i / |sum w_i q_i|, q_i the unit dual quaternion of segment i (Kavan08).
  /// Kavan08 4.1 flips q_i beside the quaternion of one pivot segment per node. Here signs are fixed once for
  /// all nodes, each segment beside its parent (kinematics::forward): with a pivot per node two neighbouring
  /// nodes with different pivots may blend opposite ways round, which tears a limb whose joints together turn
  /// through more than 180 degrees. Where a blend vanishes (two segments a whole turn apart, equal weights)
  /// the node follows the segment of its largest weight, the first of equal ones.
  void dqs() const;
  /// x' = R (x - p) + sum w_i (R_i p + t_i), with p the node's centre and R the turn of the blended
  /// quaternion sum w_i q_i / |sum w_i q_i| (LeHodgins16; Sujar18 4). Signs and vanished blends as above. A
  /// node without a centre has itself as p, which is LBS. Corrections move x in the node's own frame: x' + R
  /// u, u the sum of the fields; other methods leave them out.
  void cor() const;

  // All three: parallel over blocks of clusters in the caller's arena. Clusters do not depend on each other,
  // so any split gives the same bytes. The instruction set is chosen at run time.
};

/// Below this length a blend of unit quaternions has no direction worth following.
inline constexpr float vanished_blend = 1e-3F;

namespace kernels {
/// The clusters `job.clusters[begin .. end)`, on the calling thread.
void lbs(const SkinClusters& job, std::size_t begin, std::size_t end);
void dqs(const SkinClusters& job, std::size_t begin, std::size_t end);
void cor(const SkinClusters& job, std::size_t begin, std::size_t end);
/// What they posed, from lanes to job.nodes.
void hand_on(const SkinClusters& job, std::size_t begin, std::size_t end);
}  // namespace kernels

}  // namespace ecorche::runtime
