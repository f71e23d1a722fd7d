// SPDX-License-Identifier: Apache-2.0
// Blends of segments at one node, which several skinning jobs share.
#pragma once

#include <cmath>

#include "runtime/skin/skin_nodes.hpp"

namespace ecorche::runtime {

/// sum w_i ((R_i - I) y + u_i): the displacement of y under linear blending.
inline Vec3f blend_displacements(const SkinNodesInput& in, std::size_t node, const Vec3f& y) {
  Vec3f sum{0, 0, 0};
  for (std::uint32_t e = in.offsets[node]; e < in.offsets[node + 1]; ++e) {
    const SegmentMotion& motion = in.motions[in.segment[e]];
    const Vec3f turned = apply(motion.turn, y);
    for (std::size_t c = 0; c < 3; ++c) sum[c] += in.weight[e] * (turned[c] + motion.shift[c]);
  }
  return sum;
}

/// (R - I) y for the unit quaternion q = (w, r): 2 r x (r x y + w y). Exactly zero for the identity.
inline Vec3f turn_less_identity(const std::array<float, 4>& q, const Vec3f& y) {
  const Vec3f inner{q[2] * y[2] - q[3] * y[1] + q[0] * y[0], q[3] * y[0] - q[1] * y[2] + q[0] * y[1],
                    q[1] * y[1] - q[2] * y[0] + q[0] * y[2]};
  return {2 * (q[2] * inner[2] - q[3] * inner[1]), 2 * (q[3] * inner[0] - q[1] * inner[2]),
          2 * (q[1] * inner[1] - q[2] * inner[0])};
}

/// Below this length a blend of unit quaternions has no direction worth following.
inline constexpr float vanished_blend = 1e-3F;

/// The segment of the largest weight of a node; the lowest of equal ones.
inline const SegmentMotion& heaviest(const SkinNodesInput& in, std::size_t node) {
  std::uint32_t best = in.offsets[node];
  for (std::uint32_t e = best + 1; e < in.offsets[node + 1]; ++e) {
    if (in.weight[e] > in.weight[best]) best = e;
  }
  return in.motions[in.segment[best]];
}

}  // namespace ecorche::runtime
