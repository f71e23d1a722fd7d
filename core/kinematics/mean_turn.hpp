// SPDX-License-Identifier: Apache-2.0
// The mean of turns that lie near each other.
#pragma once

#include <Eigen/Geometry>

namespace ecorche::kinematics {

/// The normalised sum of unit quaternions, their signs made alike: the mean of rotations in the chordal
/// distance where they are near each other (Markley et al., Averaging Quaternions, 2007), weighted. No turn
/// at all is the identity.
struct MeanTurn {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  void add(const Eigen::Quaterniond& q, double weight = 1) {
    sum += (sum.dot(q.coeffs()) < 0 ? -weight : weight) * q.coeffs();
  }
  Eigen::Quaterniond mean() const {
    return sum.isZero() ? Eigen::Quaterniond::Identity() : Eigen::Quaterniond(sum.normalized());
  }
};

}  // namespace ecorche::kinematics
