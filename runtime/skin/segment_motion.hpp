// SPDX-License-Identifier: Apache-2.0
// The motion of the segments, narrowed to float32 without losing the rest pose or a rigid motion.
//
// The body is skinned in the frame of its root segment and then carried along with it, both as displacements
// from rest:
//   y  = x - origin                                 (origin: the middle of the rest body)
//   e  = blend of ((R_i - I) y + u_i)               (segment i relative to the root)
//   x' = x + e + (R_root - I)(y + e) + t_root
// At rest every term but x is exactly zero. Under a rigid motion of the whole body e is zero to 1e-12 mm and
// only the last line rounds; its sum is made in double, so that a body metres away keeps 1e-3 mm. Blending by
// weights, by dual quaternions and about centres of rotation all commute with the root's motion, so nothing
// is changed by taking it out.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>

#include "core/values/transform.hpp"

namespace ecorche::runtime {

using Vec3f = std::array<float, 3>;

/// Segment relative to the root, about the origin: y -> y + turn y + shift, in the three forms that blending
/// needs.
struct SegmentMotion {
  std::array<float, 9> turn;  ///< R - I, row-major
  Vec3f shift;                ///< mm
  std::array<float, 4> real;  ///< unit quaternion w, x, y, z; beside its parent's
  std::array<float, 4> dual;  ///< of the unit dual quaternion (Kavan08): half of (0, shift) times real, mm
};

/// What carries the body along with its root.
struct RootMotion {
  Vec3f origin;                 ///< mm
  std::array<float, 9> turn;    ///< R - I, row-major
  std::array<double, 3> shift;  ///< mm
};

/// The middle of the box around 3 * #nodes coordinates, rounded to float32.
Vec3f middle_of(std::span<const float> nodes);

/// `segments`: rigid motions from rest, LPS mm, row 0 the root, signs fixed down the tree; #segments of
/// `out`.
RootMotion make_motions(std::span<const RigidTransform> segments, const Vec3f& origin,
                        std::span<SegmentMotion> out);

/// turn y + shift.
inline Vec3f apply(const std::array<float, 9>& turn, const Vec3f& y) {
  return {turn[0] * y[0] + turn[1] * y[1] + turn[2] * y[2], turn[3] * y[0] + turn[4] * y[1] + turn[5] * y[2],
          turn[6] * y[0] + turn[7] * y[1] + turn[8] * y[2]};
}

/// The last line above: rest position x, displacement e in the root's frame.
inline void carry_with_root(const RootMotion& root, const float* x, const Vec3f& e, float* out) {
  const Vec3f z{(x[0] - root.origin[0]) + e[0], (x[1] - root.origin[1]) + e[1],
                (x[2] - root.origin[2]) + e[2]};
  const Vec3f turned = apply(root.turn, z);
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] =
        static_cast<float>(static_cast<double>(x[c]) + static_cast<double>(e[c] + turned[c]) + root.shift[c]);
  }
}

}  // namespace ecorche::runtime
