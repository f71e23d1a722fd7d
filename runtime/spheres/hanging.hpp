// SPDX-License-Identifier: Apache-2.0
// What balls hang on, said by hand (Gagvani01 4.1.1): other segments, and joints at other places.
#pragma once

#include <span>
#include <vector>

#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/transform.hpp>
#include "runtime/spheres/balls.hpp"

namespace ecorche::runtime {

struct Hanging {
  std::vector<std::int32_t> segment;  ///< of every ball, a row of the rig
  std::vector<Vec3> joint;            ///< of every segment, LPS mm at rest

  bool operator==(const Hanging&) const = default;
};

/// As the skeleton and the rig have it.
Hanging hanging_of(const VolumetricSkeleton& skeleton, const Skeleton& rig);

/// The rig with its joints there.
Skeleton with_joints(Skeleton rig, std::span<const Vec3> joint);

/// The motions of the same pose when the joints lie at `joint`: every segment turns within its parent as it
/// does in `motions`, about another place, and is shifted there as much. Equals forward() of with_joints(),
/// and needs no pose; `motions` itself where no joint has moved.
std::vector<RigidTransform> about_joints(const Skeleton& rig, std::span<const Vec3> joint,
                                         std::span<const RigidTransform> motions);

}  // namespace ecorche::runtime
