// SPDX-License-Identifier: Apache-2.0
// Two motions of one take, joint by joint.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::kinematics {

/// Poses of one rig at an even pace.
struct PoseTrack {
  std::size_t frames = 0;
  double frame_seconds = 0;
  std::function<Pose(std::size_t)> pose;  ///< of frame < frames; asked for several times
};

/// One joint in two motions.
struct JointDifference {
  std::string joint;
  double mean = 0, worst = 0;  ///< radians between the rotations
  double varying = 0;          ///< mean, when the constant turn between the two (their mean) is taken out
};

struct MotionDifference {
  /// How much later than the first the second motion begins to be recorded, s: where in it the first one's
  /// beginning is.
  double shift_seconds = 0;
  std::vector<JointDifference> joints;  ///< #segments
};

/// Over the frames of the first motion that the second has too; the second is interpolated. Makers cut a take
/// a frame earlier or later: within two frames of the slower of both, in steps of half a frame of the faster,
/// the shift is taken at which what varies is least, if that is a twentieth less than without one. What
/// turns the whole second motion about the vertical, in the mean, is another room and left out.
MotionDifference compare(const Rig& rig, const PoseTrack& one, const PoseTrack& other);

}  // namespace ecorche::kinematics
