// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/tet_energy.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>

#include "preprocess/fem/isotropic.hpp"

namespace ecorche::fem {
namespace {

using Gradients = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 10, 3>;  // of the shape functions, 1/mm

/// A tet's points of integration in the pose.
struct PosedTet {
  int points = 1;
  std::array<Gradients, 4> B;
  std::array<Eigen::Matrix3d, 4> F;
  std::array<double, 4> J{};
  double mean_j = 0;

  PosedTet(const Mesh& mesh, std::size_t t, const Points& x) {
    const Rule& rule = mesh.rule();
    points = rule.points;
    const std::int32_t* corner = &mesh.corner[t * static_cast<std::size_t>(rule.nodes)];
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 10> place(3, rule.nodes);
    for (int a = 0; a < rule.nodes; ++a) place.col(a) = x.row(corner[a]).transpose();
    for (std::size_t p = 0; p < static_cast<std::size_t>(points); ++p) {
      B[p].noalias() = rule.gradient[p].topRows(rule.nodes) * mesh.rest[t].gradient;
      F[p].noalias() = place * B[p];
      J[p] = F[p].determinant();
      mean_j += J[p] / points;
    }
  }
};

Stretched density(const Mesh& mesh, const Material& material, const Eigen::Vector3d& s, double mean_j) {
  Stretched out = material.at(s);
  const double bulk = material.bulk();
  if (mesh.element == Element::p2p0) {
    add_volume(s, bulk * (mean_j - 1), 0, out);
  } else {
    add_volume(s, bulk * (s.prod() - 1), bulk, out);
  }
  return out;
}

}  // namespace

TetEnergy tet_energy(const Mesh& mesh, const Material& material, std::size_t t, const Points& x) {
  const PosedTet posed(mesh, t, x);
  const double weight = mesh.stiffness_of(t) * mesh.rest[t].volume / posed.points;
  const double bulk = material.bulk() / 2;
  TetEnergy out;
  out.mean_j = posed.mean_j;
  out.least_j = posed.J[0];
  const bool mean = mesh.element == Element::p2p0;
  for (std::size_t p = 0; p < static_cast<std::size_t>(posed.points); ++p) {
    const double change = (mean ? posed.mean_j : posed.J[p]) - 1;
    out.energy += weight * (material.energy(posed.F[p]) + bulk * change * change);
    out.least_j = std::min(out.least_j, posed.J[p]);
  }
  return out;
}

TetDerivatives tet_derivatives(const Mesh& mesh, const Material& material, std::size_t t, const Points& x,
                               bool filtered) {
  const PosedTet posed(mesh, t, x);
  const int nodes = mesh.rule().nodes, size = 3 * nodes;
  const double weight = mesh.stiffness_of(t) * mesh.rest[t].volume / posed.points;
  const bool mean = mesh.element == Element::p2p0;
  TetDerivatives out;
  out.gradient.setZero(size);
  out.hessian.setZero(size, size);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 30, 1> dilatation;  // d mean J / d x
  dilatation.setZero(size);
  for (std::size_t p = 0; p < static_cast<std::size_t>(posed.points); ++p) {
    const Principal at = principal(posed.F[p]);
    const Stretched here = density(mesh, material, at.s, posed.mean_j);
    const Eigen::Matrix3d P = stress(at, here);
    const Matrix9d H = hessian(at, here, filtered);
    const Gradients& B = posed.B[p];
    // d F(:, j) = sum over nodes a of dx_a B(a, j)
    Eigen::Matrix<double, 9, Eigen::Dynamic, 0, 9, 30> HB(9, size);
    for (int b = 0; b < nodes; ++b)
      HB.middleCols<3>(3 * b).noalias() =
          H.middleCols<3>(0) * B(b, 0) + H.middleCols<3>(3) * B(b, 1) + H.middleCols<3>(6) * B(b, 2);
    for (int a = 0; a < nodes; ++a) {
      out.gradient.segment<3>(3 * a).noalias() += weight * P * B.row(a).transpose();
      out.hessian.middleRows<3>(3 * a).noalias() +=
          weight *
          (HB.middleRows<3>(0) * B(a, 0) + HB.middleRows<3>(3) * B(a, 1) + HB.middleRows<3>(6) * B(a, 2));
    }
    if (!mean) continue;
    const Eigen::Vector3d c(at.s[1] * at.s[2], at.s[2] * at.s[0], at.s[0] * at.s[1]);
    const Eigen::Matrix3d cofactor = at.U * c.asDiagonal() * at.V.transpose();
    for (int a = 0; a < nodes; ++a)
      dilatation.segment<3>(3 * a).noalias() += cofactor * B.row(a).transpose() / posed.points;
  }
  if (mean)
    out.hessian.noalias() +=
        mesh.stiffness_of(t) * mesh.rest[t].volume * material.bulk() * dilatation * dilatation.transpose();
  return out;
}

}  // namespace ecorche::fem
