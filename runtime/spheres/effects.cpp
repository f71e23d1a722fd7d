// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/effects.hpp"

#include <algorithm>
#include <cmath>

namespace ecorche::runtime {
namespace {

double distance2(const Vec3& a, const Vec3& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

// Index of the joint's centre in the lattice.
Vec3 joint_place(const BallSet& set, const Skeleton& rig, std::size_t segment) {
  const Eigen::Vector3d& c = rig.segments[segment].joint.center;
  return set.lattice.index({c.x(), c.y(), c.z()});
}

}  // namespace

std::vector<double> radii_at_joints(const BallSet& set, const Skeleton& rig) {
  std::vector<double> out;
  for (std::size_t s = 0; s < rig.segments.size(); ++s) {
    const Vec3 middle = joint_place(set, rig, s);
    double largest = 0;
    for (const Ball& ball : set.balls) {
      if (distance2(ball.rest, middle) < ball.rest_radius2) largest = std::max(largest, ball.rest_radius2);
    }
    out.push_back(std::sqrt(largest));
  }
  return out;
}

std::vector<JointBulge> bulges_of(const BallSet& set, const Skeleton& rig, double gain) {
  std::vector<JointBulge> out;
  const std::vector<double> radius = radii_at_joints(set, rig);
  for (std::size_t s = 1; s < radius.size(); ++s) {
    if (radius[s] > 0)
      out.push_back({static_cast<std::int32_t>(s), 1.5 * radius[s] * set.lattice.spacing[0], gain});
  }
  return out;
}

void bulge(BallSet& set, const Skeleton& rig, std::span<const JointBulge> bulges, double time) {
  for (const JointBulge& at : bulges) {
    const Vec3 middle = joint_place(set, rig, static_cast<std::size_t>(at.segment));
    const int parent = rig.segments[static_cast<std::size_t>(at.segment)].parent;
    const double reach = at.reach_mm / set.lattice.spacing[0];
    for (Ball& ball : set.balls) {
      if (ball.motion != at.segment && ball.motion != parent) continue;
      const double share = distance2(ball.rest, middle) / (reach * reach);
      if (!(share < 1)) continue;
      const double factor = std::max(1 + time * at.gain * (1 - share) * (1 - share), 0.0);
      ball.radius2 *= factor * factor;
    }
  }
}

void melt(BallSet& set, double time) {
  double largest = 0;
  for (const Ball& ball : set.balls) largest = std::max(largest, ball.rest_radius2);
  for (Ball& ball : set.balls) {
    if (time > 0 && ball.rest_radius2 <= time * time * largest) ball.radius2 = 0;
  }
}

void explode(BallSet& set, double time, double gain) {
  Vec3 mean{0, 0, 0};
  for (const Ball& ball : set.balls) {
    for (std::size_t a = 0; a < 3; ++a) mean[a] += ball.centre[a] / static_cast<double>(set.balls.size());
  }
  if (time * gain == 0) return;
  for (Ball& ball : set.balls) {
    for (std::size_t a = 0; a < 3; ++a) ball.centre[a] += time * gain * (ball.centre[a] - mean[a]);
  }
}

}  // namespace ecorche::runtime
