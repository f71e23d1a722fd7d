// SPDX-License-Identifier: Apache-2.0
#include <ecorche/kinematics/named_angles.hpp>

#include <array>
#include <map>

#include <ecorche/kinematics/angles.hpp>

namespace ecorche::kinematics {
namespace {

struct Equivalent {
  std::string_view a, b;
  double sign;
};

constexpr Equivalent kEquivalents[] = {
    {"adduction", "abduction", -1},         {"eversion", "inversion", -1},
    {"depression", "elevation", -1},        {"dorsiflexion", "flexion", -1},
    {"dorsiflexion", "plantarflexion", -1}, {"lateral_bending", "bending", 1}};

}  // namespace

std::optional<NamedAngle> find_named_angle(const Skeleton& skeleton, std::string_view joint,
                                           std::string_view angle) {
  const int row = skeleton.find_joint(joint);
  if (row < 0) return std::nullopt;
  const auto& sequence = skeleton.segments[static_cast<std::size_t>(row)].joint.sequence;
  const auto find = [&](std::string_view name, double sign) -> std::optional<NamedAngle> {
    for (std::size_t a = 0; a < sequence.size(); ++a) {
      if (sequence[a].name == name) return NamedAngle{static_cast<std::size_t>(row), a, sign};
    }
    return std::nullopt;
  };
  if (const auto own = find(angle, 1)) return own;
  for (const Equivalent& pair : kEquivalents) {
    if (pair.a != angle && pair.b != angle) continue;
    if (const auto other = find(pair.a == angle ? pair.b : pair.a, pair.sign)) return other;
  }
  return std::nullopt;
}

Pose pose_of(const Skeleton& skeleton, const std::vector<AngleValue>& values) {
  std::map<std::size_t, std::map<std::size_t, double>> sums;
  for (const AngleValue& value : values)
    sums[value.angle.row][value.angle.angle] += value.angle.sign * value.radians;
  Pose pose = Pose::rest(skeleton.segments.size());
  for (const auto& [row, angles] : sums) {
    const Joint& joint = skeleton.segments[row].joint;
    std::array<double, 3> all{0, 0, 0};
    for (std::size_t a = 0; a < joint.sequence.size() && a < 3; ++a) all[a] = joint.sequence[a].rest;
    for (const auto& [a, radians] : angles) all[a] = radians;
    pose.rotation[row] = rotation_from_angles(joint, all);
  }
  return pose;
}

}  // namespace ecorche::kinematics
