// SPDX-License-Identifier: Apache-2.0
// A bone mesh moved rigidly by its segment (DESIGN 7), not through the tets.
#pragma once

#include <span>
#include <string_view>

#include "runtime/skin/segment_motion.hpp"

namespace ecorche::runtime {

/// x' = x + (R - I)(x - origin) + t in displacement form, as segment_motion.hpp does for the root: the rest
/// pose is exact, and with the bone's own middle as origin nothing but the last sum, made in double, rounds
/// by more than 1e-4 mm.
struct BonesRigid {
  std::span<const float> rest;  ///< 3 * #V, LPS mm
  Vec3f origin;                 ///< mm, middle of the bone
  RigidTransform motion;        ///< of its segment, from rest
  std::span<float> posed;       ///< 3 * #V, LPS mm

  /// The first reason why run() must not be called; empty when it may.
  std::string_view check() const;
  /// Parallel over blocks of vertices in the caller's arena; allocates nothing.
  void run() const;
};

}  // namespace ecorche::runtime
