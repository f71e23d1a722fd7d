// SPDX-License-Identifier: Apache-2.0
// Rigid motions: a unit quaternion (w, x, y, z) and a translation; global = parent * local.
#pragma once

#include <Eigen/Geometry>

namespace ecorche {

/// x -> q x + t, mm. Double precision; run-time kernels narrow it.
struct RigidTransform {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();

  /// The point moved.
  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return q * x + t; }
  /// First `local`, then this one.
  RigidTransform operator*(const RigidTransform& local) const { return {q * local.q, q * local.t + t}; }
  /// The way back.
  RigidTransform inverse() const { return {q.conjugate(), -(q.conjugate() * t)}; }
};

}  // namespace ecorche
