// SPDX-License-Identifier: Apache-2.0
// The balls of a volumetric skeleton, placed by the motions of the segments (Gagvani01 5).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <ecorche/values/image.hpp>
#include <ecorche/values/transform.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>

namespace ecorche::runtime {

using Vec3 = std::array<double, 3>;

/// One ball, in continuous indices and voxels of BallSet::lattice.
struct Ball {
  Vec3 rest;            ///< its skeletal voxel
  Vec3 centre;          ///< where it has gone
  double radius2;       ///< squared; the ball holds what is strictly nearer
  double rest_radius2;  ///< before any effect
  std::int32_t motion;  ///< row of BallSet::back
};

/// What posed a volume: the voxel at `q` that ball b owns shows the rest volume at
///   b.rest + back[b.motion] (q - b.centre),
/// and where a ball has been made larger than it was, the rest volume at that ball's own rim.
struct BallSet {
  ImageGrid lattice;  ///< cubic voxels; the index space of everything here
  std::vector<Ball> balls;
  std::vector<std::array<double, 9>> back;  ///< row-major rotations, posed to rest
  /// Row of the first ball that owns only what no ball before this row holds: bridges (seams.hpp).
  std::int32_t bridges_from = std::numeric_limits<std::int32_t>::max();
};

/// The rest lattice of a skeleton with voxels of `spacing` mm: same first voxel centre and axes, as many
/// voxels as hold the same extent. The skeleton's own grid where `spacing` is its spacing.
ImageGrid lattice_of(const VolumetricSkeleton& skeleton, double spacing);

/// Balls at rest. A ball of the chamfer metric is the largest Euclidean one within the metric's own: its
/// radius is distance / sqrt(11), since <3,4,5> measures (3, 1, 1) longest. So no ball covers background,
/// and every skeletal voxel is in its own. Throws Error{data} for arrays that do not fit together, or voxels
/// that are not cubic.
BallSet balls_at_rest(const VolumetricSkeleton& skeleton, const ImageGrid& lattice);

/// Moves every ball with its segment. `motions`: rigid, from rest, LPS mm, one per segment of the rig. Places
/// within 1e-9 voxel of whole numbers become whole, so that rest is exact. Throws Error{data} where a voxel
/// hangs on no segment, or on one that the rig lacks.
void move_balls(const VolumetricSkeleton& skeleton, std::span<const RigidTransform> motions, BallSet& set);
/// The same, with the balls hung on other segments than the skeleton's own.
void move_balls(const VolumetricSkeleton& skeleton, std::span<const std::int32_t> segment,
                std::span<const RigidTransform> motions, BallSet& set);

}  // namespace ecorche::runtime
