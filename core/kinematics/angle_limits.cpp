// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/angle_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <ecorche/kinematics/angles.hpp>

namespace ecorche::kinematics {

std::pair<double, double> angle_range(const Joint& joint, std::size_t angle) {
  const bool limited = std::any_of(joint.sequence.begin(), joint.sequence.end(), [](const AngleAxis& a) {
    return std::isfinite(a.min) || std::isfinite(a.max);
  });
  const AngleAxis& a = joint.sequence[angle];
  const bool several = joint.kind == JointKind::ball || joint.kind == JointKind::free;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (several && !limited) return {-infinity, infinity};
  const double open = angle == 1 ? std::numbers::pi / 2 : std::numbers::pi;
  return {std::min(std::isfinite(a.min) ? a.min : -open, a.rest),
          std::max(std::isfinite(a.max) ? a.max : open, a.rest)};
}

std::array<double, 3> other_triple(const Joint& joint, const std::array<double, 3>& angles) {
  constexpr double pi = std::numbers::pi;
  const auto wrapped = [](double x) { return std::remainder(x, 2 * pi); };
  return {wrapped(angles[0] + pi), wrapped(joint.sequence[1].sign * pi - angles[1]), wrapped(angles[2] + pi)};
}

std::array<double, 3> angles_within_limits(const Joint& joint, const Eigen::Quaterniond& rotation) {
  if (joint.sequence.size() != 3) return {0, 0, 0};
  constexpr double pi = std::numbers::pi;
  std::array<double, 3> one = angles_from_rotation(joint, rotation);
  std::array<double, 3> two = other_triple(joint, one);
  const auto outside = [&](std::array<double, 3>& a) {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [low, high] = angle_range(joint, i);
      while (a[i] > high && a[i] - 2 * pi >= low) a[i] -= 2 * pi;
      while (a[i] < low && a[i] + 2 * pi <= high) a[i] += 2 * pi;
      sum += std::max({a[i] - high, low - a[i], 0.0});
    }
    return sum;
  };
  const double first = outside(one), second = outside(two);
  return second < first - 1e-9 ? two : one;
}

}  // namespace ecorche::kinematics
