// SPDX-License-Identifier: Apache-2.0
#include "io/case/joint_axes.hpp"

#include <Eigen/Geometry>

#include "io/case/skeleton_file.hpp"

namespace ecorche::io {
namespace {

// Two axes closer to parallel than this (sine, 6 degrees) say nothing certain about the third.
constexpr double kLeastSine = 0.1;
constexpr double kAlreadyOrthonormal = 1e-9;

}  // namespace

Eigen::Matrix3d read_joint_axes(const yaml::Value& value, const Frame& frame) {
  value.allow(skeleton_keys::axes);
  Eigen::Matrix3d given = Eigen::Matrix3d::Zero();
  std::vector<int> named;
  for (const auto& [letter, direction] : value.pairs()) {  // the first in the file keeps its direction
    const int axis = letter[0] - 'x';
    const auto numbers = direction.numbers<3>();
    const Eigen::Vector3d file(numbers[0], numbers[1], numbers[2]);
    if (file.stableNorm() < 1e-12) direction.fail("has no length", "write a direction");
    given.col(axis) = frame.axes * file;
    named.push_back(axis);
  }
  if (named.size() < 2) value.fail("names " + std::to_string(named.size()) + " axes", "name two of x, y, z");

  const int first = named[0], second = named[1], last = 3 - first - second;
  // x = y cross z and round: the sign of second x last seen from first.
  const double turn = second == (first + 1) % 3 ? 1 : -1;
  Eigen::Matrix3d axes;
  axes.col(first) = given.col(first).stableNormalized();
  const Eigen::Vector3d direction = given.col(second).stableNormalized();
  const Eigen::Vector3d across = direction - axes.col(first) * axes.col(first).dot(direction);
  if (across.norm() < kLeastSine) value.fail("the axes are collinear", "give two that stand apart");
  axes.col(second) = across.normalized();
  axes.col(last) = turn * axes.col(first).cross(axes.col(second));
  if (named.size() == 3) {
    const double along = axes.col(last).dot(given.col(last).stableNormalized());
    if (along < 0)
      value.fail("the axes are left-handed in the patient", "turn one of them round, or leave one out");
    if (along < 1 - kLeastSine)
      value.fail("the axes are far from right angles", "leave one out: two suffice");
  } else {
    given.col(last) = axes.col(last);
  }
  const bool orthonormal =
      (given.transpose() * given - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kAlreadyOrthonormal;
  return orthonormal ? given : axes;
}

}  // namespace ecorche::io
