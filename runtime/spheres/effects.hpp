// SPDX-License-Identifier: Apache-2.0
// Effects on placed balls (Gagvani01 6), each with a time from 0, where it does nothing, to 1.
#pragma once

#include <span>
#include <vector>

#include <ecorche/values/skeleton.hpp>
#include "runtime/spheres/balls.hpp"

namespace ecorche::runtime {

/// Balls of the segment and of its parent whose rest centres lie within `reach` of the joint's centre grow by
/// the factor 1 + time * gain * (1 - (d / reach)^2)^2 (gain < 0: shrink, not below nothing). What a ball
/// gains is a shell that shows the ball's own rim (rest_place): skin goes on as skin.
struct JointBulge {
  std::int32_t segment = 0;  ///< row; its joint's centre is the middle
  double reach_mm = 0;       ///< positive
  double gain = 0.3;         ///< above -1
};

/// Of every segment of `rig` the radius, voxels, of the largest ball that holds its joint's centre at rest; 0
/// where none does.
std::vector<double> radii_at_joints(const BallSet& set, const Skeleton& rig);

/// A bulge at every joint but the root's: `reach` is 1.5 times the radius of the largest ball that holds the
/// joint's centre at rest; joints outside every ball get none.
std::vector<JointBulge> bulges_of(const BallSet& set, const Skeleton& rig, double gain);

void bulge(BallSet& set, const Skeleton& rig, std::span<const JointBulge> bulges, double time);

/// Small radii first: balls up to `time` times the largest radius are gone, all at 1.
void melt(BallSet& set, double time);

/// Every centre goes away from the mean of all, to 1 + time * gain times its distance. Balls keep their
/// sizes, so gaps open between them.
void explode(BallSet& set, double time, double gain);

}  // namespace ecorche::runtime
