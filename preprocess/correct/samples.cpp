// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <ecorche/kinematics/angles.hpp>

namespace ecorche::correct {
namespace {

constexpr double kLeast = 0.02;  // radians: a smaller turn says nothing, and two samples are farther apart

std::size_t angles_of(JointKind kind) {
  switch (kind) {
    case JointKind::ball:
    case JointKind::free:
      return 3;
    case JointKind::universal:
      return 2;
    case JointKind::hinge:
      return 1;
    case JointKind::fixed:
      break;
  }
  return 0;
}

bool driven(const Joint& joint, std::size_t angle) {
  return std::any_of(joint.coupled.begin(), joint.coupled.end(),
                     [&](const Coupling& c) { return c.drives == joint.sequence[angle].name; });
}

class Chains {
 public:
  Chains(const Skeleton& skeleton, std::size_t joint) : skeleton_(skeleton), joint_(joint) {}

  /// Along `whole` (radians from rest, along the sequence) at `steps` equal parts.
  void add(const Eigen::Vector3d& whole, int steps) {
    int from = -1;
    for (int i = 1; i <= steps; ++i) {
      Sample sample = sample_at(skeleton_, joint_, whole * i / steps, from);
      if (!is_new(sample.turn)) continue;
      from = static_cast<int>(samples_.size());
      samples_.push_back(std::move(sample));
    }
  }
  std::vector<Sample> take() { return std::move(samples_); }

 private:
  bool is_new(const Eigen::RowVector3d& turn) const {
    return turn.norm() > kLeast && std::all_of(samples_.begin(), samples_.end(), [&](const Sample& other) {
             return (other.turn - turn).norm() > kLeast;
           });
  }

  const Skeleton& skeleton_;
  std::size_t joint_;
  std::vector<Sample> samples_;
};

}  // namespace

bool turns_by_itself(const Skeleton& skeleton, std::size_t joint) {
  const Joint& j = skeleton.segments[joint].joint;
  return joint > 0 && angles_of(j.kind) > 0 && !driven(j, 0);
}

double reach(const Joint& joint, std::size_t angle, int way) {
  if (angle >= angles_of(joint.kind) || driven(joint, angle)) return 0;
  const AngleAxis& a = joint.sequence[angle];
  return std::clamp(way > 0 ? a.max - a.rest : a.rest - a.min, 0.0, kFarthest);
}

Pose turned(const Skeleton& skeleton, std::size_t joint, const Eigen::Vector3d& from_rest) {
  const Joint& j = skeleton.segments[joint].joint;
  Pose pose = Pose::rest(skeleton.segments.size());
  pose.rotation[joint] = kinematics::rotation_from_angles(
      j, {j.sequence[0].rest + from_rest[0], j.sequence[1].rest + from_rest[1],
          j.sequence[2].rest + from_rest[2]});
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(skeleton, pose, clamped);
  return pose;
}

Sample sample_at(const Skeleton& skeleton, std::size_t joint, const Eigen::Vector3d& from_rest, int from) {
  Sample out{from_rest, turned(skeleton, joint, from_rest), {}, from};
  out.turn = rotation_vector(out.pose.rotation[joint]);
  return out;
}

Eigen::RowVector3d rotation_vector(const Eigen::Quaterniond& turn) {
  const Eigen::AngleAxisd around(turn.w() < 0 ? Eigen::Quaterniond(-turn.coeffs()) : turn);
  return around.angle() * around.axis().transpose();
}

std::vector<Sample> samples_of(const Skeleton& skeleton, std::size_t joint, double step) {
  Chains chains(skeleton, joint);
  const Joint& j = skeleton.segments[joint].joint;
  const bool hinge = j.kind == JointKind::hinge;
  for (std::size_t a = 0; a < 3; ++a) {
    for (const int way : {1, -1}) {
      const double far = reach(j, a, way);
      const int steps = hinge ? static_cast<int>(std::ceil(far / step)) : 3;
      chains.add(way * far * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(a)), steps);
    }
  }
  for (int corner = 0; !hinge && corner < 8; ++corner) {
    Eigen::Vector3d half = Eigen::Vector3d::Zero();
    for (std::size_t a = 0; a < 3; ++a) {
      const int way = (corner >> a & 1) != 0 ? -1 : 1;
      half[static_cast<Eigen::Index>(a)] = way * reach(j, a, way) / 2;
    }
    chains.add(half, 2);
  }
  return chains.take();
}

}  // namespace ecorche::correct
