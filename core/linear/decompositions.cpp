// SPDX-License-Identifier: Apache-2.0
#include "core/linear/decompositions.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace ecorche::linear {

using Eigen::Matrix3d;

Svd svd(const Matrix3d& M) {
  const Eigen::JacobiSVD<Matrix3d> of(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {of.matrixU(), of.matrixV(), of.singularValues()};
}

SymmetricEigen symmetric_eigen(const Matrix3d& S) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> of(S);
  return {of.eigenvalues(), of.eigenvectors()};
}

Matrix3d nearest_turn(const Matrix3d& M) {
  const Svd of = svd(M);
  const double mirrored = (of.U * of.V.transpose()).determinant() < 0 ? -1 : 1;
  return of.U * Eigen::Vector3d(1, 1, mirrored).asDiagonal() * of.V.transpose();
}

Eigen::Quaterniond turn_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

}  // namespace ecorche::linear
