// SPDX-License-Identifier: Apache-2.0
// From a material's principal stretches to its stress and Hessian in the deformation gradient F, by the
// analytic eigen-system of isotropic energies (Smith19).
#pragma once

#include <Eigen/Core>

#include "preprocess/fem/material.hpp"

namespace ecorche::fem {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// F = U diag(s) V', U and V rotations; |s_0| >= |s_1| >= |s_2|, and only s_2 may be negative.
struct Principal {
  Eigen::Matrix3d U, V;
  Eigen::Vector3d s;
};
Principal principal(const Eigen::Matrix3d& F);

/// First Piola-Kirchhoff stress, d energy / d F.
Eigen::Matrix3d stress(const Principal& at, const Stretched& density);

/// d^2 energy / d F^2 over vec(F), column by column. Its eigenvectors are three twists, three flips and three
/// mixed scalings; `filtered` lifts negative eigenvalues to 0: the nearest positive semi-definite matrix.
Matrix9d hessian(const Principal& at, const Stretched& density, bool filtered);

}  // namespace ecorche::fem
