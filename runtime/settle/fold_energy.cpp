// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/fold_energy.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace ecorche::runtime {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kTetsPerBlock = 1024;

Matrix3d jacobian(const FoldPatch::Tet& tet, std::span<const double> x) {
  Matrix3d J = Matrix3d::Zero();
  for (std::size_t a = 0; a < 4; ++a) {
    J += Eigen::Map<const Vector3d>(&x[3 * static_cast<std::size_t>(tet.node[a])]) *
         Eigen::Map<const Vector3d>(tet.gradient[a].data()).transpose();
  }
  return J;
}

/// Derivative of the determinant.
Matrix3d cofactors(const Matrix3d& J) {
  Matrix3d K;
  K.col(0) = J.col(1).cross(J.col(2));
  K.col(1) = J.col(2).cross(J.col(0));
  K.col(2) = J.col(0).cross(J.col(1));
  return K;
}

/// Cost of one tet; `P` gets its derivative by J.
double cost_of(const Matrix3d& J, double eps, Matrix3d& P) {
  const Matrix3d K = cofactors(J);
  const double det = J.col(0).dot(K.col(0)), root = std::sqrt(eps * eps + det * det);
  // Without the difference of near numbers that det < 0 would bring.
  const double chi = det > 0 ? (det + root) / 2 : eps * eps / (2 * (root - det));
  const double by_det = chi / root;  // of chi
  const double shape = J.squaredNorm() / std::cbrt(chi * chi), volume = (det * det + 1) / chi;
  P = J / std::cbrt(chi * chi) + ((det - volume * by_det / 2 - shape * by_det / 3) / chi) * K;
  return (shape + volume) / 2;
}

void put(const Vector3d& v, double* where) {
  std::copy(v.begin(), v.end(), where);
}

template <class F>
void each_block(std::size_t count, F f) {
  tbb::parallel_for(std::size_t{0}, (count + kTetsPerBlock - 1) / kTetsPerBlock,
                    [&](std::size_t b) { f(b * kTetsPerBlock, std::min(count, (b + 1) * kTetsPerBlock)); });
}

}  // namespace

FoldEnergy::FoldEnergy(const FoldPatch& patch)
    : patch_(patch), first_(patch.free + 1, 0), pull_(patch.tets.size()), cost_(patch.tets.size()) {
  const auto each_free_corner = [&](auto f) {
    for (std::size_t t = 0; t < patch.tets.size(); ++t)
      for (std::size_t a = 0; a < 4; ++a) {
        const auto n = static_cast<std::size_t>(patch.tets[t].node[a]);
        if (n < patch.free) f(n, static_cast<std::uint32_t>(4 * t + a));
      }
  };
  each_free_corner([&](std::size_t n, std::uint32_t) { ++first_[n + 1]; });
  for (std::size_t n = 0; n < patch.free; ++n) first_[n + 1] += first_[n];
  corner_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  each_free_corner([&](std::size_t n, std::uint32_t corner) { corner_[next[n]++] = corner; });
}

double FoldEnergy::operator()(std::span<const double> x, double eps, std::span<double> gradient) const {
  each_block(patch_.tets.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const FoldPatch::Tet& tet = patch_.tets[t];
      Matrix3d P;
      cost_[t] = tet.weight * cost_of(jacobian(tet, x), eps, P);
      if (gradient.empty()) continue;
      for (std::size_t a = 0; a < 4; ++a) {
        put(tet.weight * (P * Eigen::Map<const Vector3d>(tet.gradient[a].data())), pull_[t].data() + 3 * a);
      }
    }
  });
  double sum = 0;
  for (const double cost : cost_) sum += cost;
  if (gradient.empty()) return sum;
  each_block(patch_.free, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      Vector3d all = Vector3d::Zero();
      for (std::uint32_t i = first_[n]; i < first_[n + 1]; ++i)
        all += Eigen::Map<const Vector3d>(&pull_[corner_[i] / 4][3 * (corner_[i] % 4)]);
      put(all, gradient.data() + 3 * n);
    }
  });
  return sum;
}

FoldEnergy::Folds FoldEnergy::folds(std::span<const double> x) const {
  Folds out;
  for (const FoldPatch::Tet& tet : patch_.tets) {
    const double det = jacobian(tet, x).determinant();
    out.least = std::min(out.least, det);
    out.count += det <= 0 ? 1 : 0;
  }
  return out;
}

}  // namespace ecorche::runtime
