// SPDX-License-Identifier: Apache-2.0
// What the three skinning jobs share: spans of one body, and the blocks in which nodes are worked on.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "runtime/skin/segment_motion.hpp"

namespace ecorche::runtime {

/// Nodes of one body, their weights and the motion of its segments. A job owns nothing and allocates nothing.
/// Node n has entries offsets[n] .. offsets[n + 1] of `segment` and `weight`, which sum to 1.
struct SkinNodesInput {
  std::span<const float> rest;             ///< 3 * #nodes, LPS mm
  std::span<const std::uint32_t> offsets;  ///< #nodes + 1
  std::span<const std::uint16_t> segment;  ///< #entries; below motions.size(), which is not checked here
  std::span<const float> weight;           ///< #entries
  std::span<const SegmentMotion> motions;  ///< #segments
  RootMotion root;

  std::size_t nodes() const { return rest.size() / 3; }
  /// The first reason why a job on these spans cannot run; empty when it can.
  std::string_view check(std::span<const float> posed) const;
};

/// Nodes per task. Nodes do not depend on each other, so any split gives the same bytes; this one is large
/// enough to hide the scheduler and small enough to share a frame between many cores.
inline constexpr std::size_t nodes_per_task = 2048;

/// y = x - origin of node n.
inline Vec3f about_origin(const SkinNodesInput& in, std::size_t n) {
  return {in.rest[3 * n] - in.root.origin[0], in.rest[3 * n + 1] - in.root.origin[1],
          in.rest[3 * n + 2] - in.root.origin[2]};
}

}  // namespace ecorche::runtime
