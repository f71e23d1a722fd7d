// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <random>
#include <string>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::test {

inline Eigen::Quaterniond turn(const Eigen::Vector3d& axis, double angle) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

inline Eigen::Quaterniond random_turn(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
}

inline std::vector<AngleAxis> sequence(const std::array<int, 3>& axes,
                                       const std::array<double, 3>& signs = {1, 1, 1},
                                       const std::array<double, 3>& rest = {0, 0, 0}) {
  const std::array<const char*, 3> names{"flexion", "adduction", "rotation"};
  std::vector<AngleAxis> out(3);
  for (std::size_t i = 0; i < 3; ++i) {
    out[i].name = names[i];
    out[i].axis = axes[i];
    out[i].sign = signs[i];
    out[i].rest = rest[i];
  }
  return out;
}

/// Segments `s0`, `s1`, ... in a chain along z, joints `j0`, `j1`, ... 100 mm apart, all balls.
inline Rig chain(int count) {
  Rig rig;
  rig.skeleton.name = "chain";
  for (int s = 0; s < count; ++s) {
    Segment segment;
    segment.name = "s" + std::to_string(s);
    segment.parent = s - 1;
    segment.joint.name = "j" + std::to_string(s);
    segment.joint.center = {0, 0, 100.0 * s};
    segment.joint.sequence = sequence({0, 1, 2});
    rig.skeleton.segments.push_back(segment);
    rig.fits.push_back({segment.joint.name, CenterRule::given, 0, 0, 1, 0});
  }
  return rig;
}

/// Adds a ball without limits.
inline void add_segment(Rig& rig, const char* name, int parent, const Eigen::Vector3d& center) {
  Segment segment;
  segment.name = name;
  segment.parent = parent;
  segment.joint.name = std::string(name) + "_joint";
  segment.joint.center = center;
  segment.joint.sequence = sequence({0, 1, 2});
  rig.skeleton.segments.push_back(segment);
  rig.fits.push_back({segment.joint.name, CenterRule::given, 0, 0, 1, 0});
}

/// A body with trunk and two legs.
inline Rig legs() {
  Rig rig;
  add_segment(rig, "pelvis", -1, {0, 0, 900});
  add_segment(rig, "thigh_left", 0, {90, 0, 880});
  add_segment(rig, "shank_left", 1, {90, 10, 480});
  add_segment(rig, "foot_left", 2, {90, 20, 80});
  add_segment(rig, "thigh_right", 0, {-90, 0, 880});
  add_segment(rig, "shank_right", 4, {-90, 10, 480});
  add_segment(rig, "foot_right", 5, {-90, 20, 80});
  return rig;
}

}  // namespace ecorche::test
