// SPDX-License-Identifier: Apache-2.0
// What a motion does that a body would not: feet that slide, joints beyond their limits.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::kinematics {

/// Sliding of one point near the ground, after Zhang et al., Mode-Adaptive Neural Networks for Quadruped
/// Motion Control (2018): a step of the point over the ground counts by 2 - 2^(h / 25 mm), with h its height
/// over the lowest place it comes to, and not at all above 25 mm. Over the ground as `MotionReport::ground`
/// has it.
struct FootSliding {
  std::string joint;          ///< whose centre is the point: ankle, or toes
  double contact_share = 0;   ///< of the frames, h < 25 mm
  double mean_mm_per_s = 0;   ///< over the frames in contact
  double worst_mm_per_s = 0;  ///< of one step
};

/// What the limits of one joint would take away; half a degree counts, less does not. Of a hinge only what is
/// about its own axis: it has no limits for turns that it cannot make.
struct LimitViolation {
  std::string joint;
  double share = 0;  ///< of the frames
  double mean = 0;   ///< radians, over those frames
  double worst = 0;  ///< radians
  std::size_t worst_frame = 0;
};

struct MotionReport {
  std::vector<FootSliding> feet;
  /// How the ground moves, mm/s: not at all, but for a body that walks in place, as on a treadmill, where it
  /// goes as feet do in the mean while they stand.
  Eigen::Vector2d ground = Eigen::Vector2d::Zero();
  std::vector<LimitViolation> limits;  ///< joints that are ever beyond theirs, the worst first
};

/// Looks at every frame once: `pose(frame)` is called for 0 to frames - 1. Angles are told as
/// asked, feet as they stand after the limits. Feet are the segments with the names of feet and toes
/// (joint_names.hpp).
MotionReport report(const Rig& rig, std::size_t frames, double frame_seconds,
                    const std::function<Pose(std::size_t)>& pose);

}  // namespace ecorche::kinematics
