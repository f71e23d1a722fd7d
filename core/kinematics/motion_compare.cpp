// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/motion_compare.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <ecorche/kinematics/interpolate.hpp>
#include "core/kinematics/mean_turn.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;

constexpr double kShiftFrames = 2;       // of the slower motion, either way
constexpr std::size_t kShiftTried = 96;  // frames that a shift is judged by
constexpr double kBetter = 0.95;         // of what varies without a shift
constexpr double kNothingToMend = 1e-6;  // radians, over all joints: nothing to mend

// The pose at a time; nothing before the first and after the last frame.
std::optional<Pose> pose_at(const PoseTrack& track, double seconds) {
  const double at = seconds / track.frame_seconds;
  const double last = static_cast<double>(track.frames) - 1;
  if (at < -1e-9 || at > last + 1e-9) return std::nullopt;
  const auto k = static_cast<std::size_t>(std::clamp(at, 0.0, last));
  const double share = std::clamp(at - static_cast<double>(k), 0.0, 1.0);
  if (share == 0) return track.pose(k);
  return between(track.pose(k), track.pose(std::min(k + 1, track.frames - 1)), share);
}

// Calls visit(a, b) with both poses of every `step`th frame that both have.
template <class Visit>
void for_pairs(const PoseTrack& one, const PoseTrack& other, double shift, std::size_t step, Visit visit) {
  for (std::size_t frame = 0; frame < one.frames; frame += step) {
    std::optional<Pose> b = pose_at(other, static_cast<double>(frame) * one.frame_seconds + shift);
    if (b) visit(one.pose(frame), *b);
  }
}

// Three passes: how the rooms are turned against each other, the mean turns, what is left of them.
std::vector<JointDifference> differences(const Rig& rig, const PoseTrack& one, const PoseTrack& other,
                                         double shift, std::size_t step) {
  const std::size_t joints = rig.skeleton.segments.size();
  std::vector<JointDifference> out(joints);
  const Quaterniond frame0(rig.skeleton.segments[0].joint.axes);
  const auto in_room = [&](const Quaterniond& q) { return frame0 * q * frame0.conjugate(); };
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();  // cosine and sine of half the turn, summed
  for_pairs(one, other, shift, step, [&](const Pose& a, const Pose& b) {
    const Quaterniond apart = in_room(b.rotation[0]) * in_room(a.rotation[0]).conjugate();
    const Eigen::Vector2d turn(apart.w(), apart.z());
    heading += heading.dot(turn) < 0 ? -turn : turn;
  });
  Quaterniond back = Quaterniond::Identity();
  if (heading.norm() > 0) {
    heading.normalize();
    back = Quaterniond(heading[0], 0, 0, -heading[1]);
  }
  const auto apart = [&](const Pose& a, const Pose& b, std::size_t j) {
    const Quaterniond second =
        j > 0 ? b.rotation[j] : frame0.conjugate() * back * in_room(b.rotation[0]) * frame0;
    return Quaterniond(a.rotation[j].conjugate() * second);
  };
  std::vector<MeanTurn> means(joints);
  std::size_t compared = 0;
  for_pairs(one, other, shift, step, [&](const Pose& a, const Pose& b) {
    ++compared;
    for (std::size_t j = 0; j < joints; ++j) {
      const Quaterniond turn = apart(a, b, j);
      const double angle = turn.angularDistance(Quaterniond::Identity());
      means[j].add(turn);
      out[j].mean += angle;
      out[j].worst = std::max(out[j].worst, angle);
    }
  });
  for_pairs(one, other, shift, step, [&](const Pose& a, const Pose& b) {
    for (std::size_t j = 0; j < joints; ++j)
      out[j].varying += apart(a, b, j).angularDistance(means[j].mean());
  });
  for (std::size_t j = 0; j < joints; ++j) {
    out[j].joint = rig.skeleton.segments[j].joint.name;
    if (compared == 0) continue;
    out[j].mean /= static_cast<double>(compared);
    out[j].varying /= static_cast<double>(compared);
  }
  return out;
}

double find_shift(const Rig& rig, const PoseTrack& one, const PoseTrack& other) {
  const std::size_t step = std::max<std::size_t>(1, one.frames / kShiftTried);
  const auto varying = [&](double shift) {
    double sum = 0;
    for (const JointDifference& joint : differences(rig, one, other, shift, step)) sum += joint.varying;
    return sum;
  };
  const double least_step = 0.5 * std::min(one.frame_seconds, other.frame_seconds);
  const auto steps = static_cast<int>(
      std::lround(kShiftFrames * std::max(one.frame_seconds, other.frame_seconds) / least_step));
  const double none = varying(0);
  double best = 0, least = kBetter * none - kNothingToMend;
  for (int k = 1; k <= steps; ++k) {
    for (const double shift : {-k * least_step, k * least_step}) {
      const double here = varying(shift);
      if (here >= least) continue;
      least = here;
      best = shift;
    }
  }
  return best;
}

}  // namespace

MotionDifference compare(const Rig& rig, const PoseTrack& one, const PoseTrack& other) {
  MotionDifference out;
  out.shift_seconds = find_shift(rig, one, other);
  out.joints = differences(rig, one, other, out.shift_seconds, 1);
  return out;
}

}  // namespace ecorche::kinematics
