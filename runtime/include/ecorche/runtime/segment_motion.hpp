// SPDX-License-Identifier: Apache-2.0
// The motion of the segments, narrowed to float32 without losing the rest pose or a rigid motion.
//
// The body is skinned about its middle, as displacements from rest, and then carried along with its root:
//   y  = x - origin                                 (origin: the middle of the rest body)
//   e  = blend of ((R_i - I) y + u_i)               (segment i, less the way that the root takes the origin)
//   x' = x + e + t_root
// At rest every term but x is exactly zero. Taken apart from the way of the root, all numbers of a blend are
// within the body's own size, so that a body metres away keeps 1e-3 mm. Blending by weights, by dual
// quaternions and about centres of rotation all commute with a translation, so nothing is changed by it.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>

#include <ecorche/values/transform.hpp>

namespace ecorche::runtime {

using Vec3f = std::array<float, 3>;

/// Segment about the origin, less the root's way: y -> y + turn y + shift, in the three forms that blending
/// needs.
struct SegmentMotion {
  std::array<float, 9> turn;  ///< R - I, row-major
  Vec3f shift;                ///< mm
  std::array<float, 4> real;  ///< unit quaternion w, x, y, z; beside its parent's
  std::array<float, 4> dual;  ///< of the unit dual quaternion (Kavan08): half of (0, shift) times real, mm
};

/// The root about the origin: y -> y + turn y + shift.
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

}  // namespace ecorche::runtime
