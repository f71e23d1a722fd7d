// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

/// What is asked of 3 by 3 matrices and of directions. Finite in, finite out.
namespace ecorche::linear {

/// M = U diag(s) V'.
struct Svd {
  Eigen::Matrix3d U, V;  ///< Orthogonal; each alone may mirror.
  Eigen::Vector3d s;     ///< Falling, not negative.
};
Svd svd(const Eigen::Matrix3d& M);

/// S = vectors diag(values) vectors', of a symmetric S: its lower half is read.
struct SymmetricEigen {
  Eigen::Vector3d values;   ///< Rising.
  Eigen::Matrix3d vectors;  ///< Orthonormal columns.
};
SymmetricEigen symmetric_eigen(const Eigen::Matrix3d& S);

/// The rotation R, never a mirror, with the largest trace of R' M. With M the sum of to * from' over points
/// about their means it takes `from` as near to `to` as a turn can, by least squares (Kabsch76).
Eigen::Matrix3d nearest_turn(const Eigen::Matrix3d& M);

/// The shortest turn of direction `from` to direction `to`, of any lengths but 0; one of all where they are
/// opposite.
Eigen::Quaterniond turn_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace ecorche::linear
