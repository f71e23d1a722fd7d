// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/isotropic.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "core/linear/decompositions.hpp"

namespace ecorche::fem {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Principal principal(const Matrix3d& F) {
  const linear::Svd of = linear::svd(F);
  Principal out{of.U, of.V, of.s};
  if (out.U.determinant() < 0) {
    out.U.col(2) *= -1;
    out.s[2] *= -1;
  }
  if (out.V.determinant() < 0) {
    out.V.col(2) *= -1;
    out.s[2] *= -1;
  }
  return out;
}

Matrix3d stress(const Principal& at, const Stretched& density) {
  return at.U * density.stress.asDiagonal() * at.V.transpose();
}

Matrix9d hessian(const Principal& at, const Stretched& density, bool filtered) {
  const auto lifted = [filtered](double value) { return filtered ? std::max(value, 0.0) : value; };
  Matrix3d scaling = density.curvature;
  // Most are positive definite, which their minors tell sooner than their eigenvalues.
  const bool definite =
      scaling(0, 0) > 0 && scaling.topLeftCorner<2, 2>().determinant() > 0 && scaling.determinant() > 0;
  if (filtered && !definite) {
    const linear::SymmetricEigen of = linear::symmetric_eigen(scaling);
    if (of.values[0] < 0) scaling = of.vectors * of.values.cwiseMax(0).asDiagonal() * of.vectors.transpose();
  }
  // In the principal axes an entry F_ij couples with F_ji alone, and the diagonal ones with each other.
  Matrix9d local = Matrix9d::Zero();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) local(4 * i, 4 * j) = scaling(i, j);
    const int a = (i + 1) % 3, b = (i + 2) % 3, ab = a + 3 * b, ba = b + 3 * a;
    const double twist = lifted(density.twist[i]), flip = lifted(density.flip[i]);
    local(ab, ab) = local(ba, ba) = (flip + twist) / 2;
    local(ab, ba) = local(ba, ab) = (flip - twist) / 2;
  }
  Matrix9d turn;  // vec(U X V') = turn vec(X)
  for (int j = 0; j < 3; ++j)
    for (int l = 0; l < 3; ++l) turn.block<3, 3>(3 * j, 3 * l) = at.V(j, l) * at.U;
  return turn * local * turn.transpose();
}

}  // namespace ecorche::fem
