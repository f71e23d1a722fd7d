// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/fold_energy.hpp"

#include <algorithm>
#include <cmath>

namespace ecorche::runtime {
namespace {

using Eigen::Matrix3d;

/// Cost of one tet; `P` gets its derivative by J.
double cost_of(const Matrix3d& J, double eps, Matrix3d& P) {
  const Matrix3d K = elastic::cofactors(J);
  const double det = J.col(0).dot(K.col(0)), root = std::sqrt(eps * eps + det * det);
  // Without the difference of near numbers that det < 0 would bring.
  const double chi = det > 0 ? (det + root) / 2 : eps * eps / (2 * (root - det));
  const double by_det = chi / root;  // of chi
  const double shape = J.squaredNorm() / std::cbrt(chi * chi), volume = (det * det + 1) / chi;
  P = J / std::cbrt(chi * chi) + ((det - volume * by_det / 2 - shape * by_det / 3) / chi) * K;
  return (shape + volume) / 2;
}

}  // namespace

double FoldEnergy::operator()(std::span<const double> x, double eps, std::span<double> gradient) const {
  return sum_(
      x, [eps](const Matrix3d& J, Matrix3d& P) { return cost_of(J, eps, P); }, gradient, scratch_);
}

FoldEnergy::Folds FoldEnergy::folds(std::span<const double> x) const {
  Folds out;
  for (const FoldPatch::Tet& tet : patch_.tets) {
    const double det = FoldPatch::deformation(tet, x).determinant();
    out.least = std::min(out.least, det);
    out.count += det <= 0 ? 1 : 0;
  }
  return out;
}

}  // namespace ecorche::runtime
