// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "preprocess/weights/harmonic.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::weights {
namespace {

using solve::SparseMatrix;

Eigen::MatrixXd dense(const SparseMatrix& L) {
  return Eigen::MatrixXd(L).selfadjointView<Eigen::Lower>();
}

/// As near to these corners as to each other.
Eigen::Vector3d circumcentre(const std::vector<Eigen::Vector3d>& p) {
  Eigen::MatrixXd A(p.size() - 1, 3);
  Eigen::VectorXd b(p.size() - 1);
  for (std::size_t n = 1; n < p.size(); ++n) {
    A.row(static_cast<Eigen::Index>(n) - 1) = 2 * (p[n] - p[0]).transpose();
    b[static_cast<Eigen::Index>(n) - 1] = (p[n] - p[0]).squaredNorm();
  }
  return p[0] + A.completeOrthogonalDecomposition().solve(b);  // the least one: in the corners' plane
}

TEST(FiniteVolumes, OfOneTetAreTheSignedAreasBetweenCells) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> draw(-3, 3);
  Tets T(1, 4);
  T << 0, 1, 2, 3;
  for (int round = 0; round < 50; ++round) {
    Points V(4, 3);
    for (Eigen::Index n = 0; n < 12; ++n) V.data()[n] = draw(random);
    const auto p = [&](Eigen::Index n) -> Eigen::Vector3d { return V.row(n).transpose(); };
    const double volume = (p(1) - p(0)).cross(p(2) - p(0)).dot(p(3) - p(0)) / 6;
    if (std::abs(volume) < 0.3) continue;
    if (volume < 0) V.row(2).swap(V.row(3));
    const Eigen::MatrixXd L = dense(finite_volumes(V, T, {}, nullptr));
    const Eigen::Vector3d o = circumcentre({p(0), p(1), p(2), p(3)});
    double sum = 0;
    for (Eigen::Index a = 0; a < 4; ++a)
      for (Eigen::Index b = a + 1; b < 4; ++b) {
        Eigen::Index c = 0, d = 3;
        while (c == a || c == b) ++c;
        while (d == a || d == b) --d;
        // The quadrilateral middle, face, o, face, seen along the edge, counter-clockwise where c comes
        // before d.
        const Eigen::Vector3d middle = 0.5 * (p(a) + p(b));
        const Eigen::Vector3d along = (p(b) - p(a)).normalized();
        const Eigen::Vector3d f = circumcentre({p(a), p(b), p(c)}) - middle,
                              g = circumcentre({p(a), p(b), p(d)}) - middle;
        const double turn = (p(c) - middle).cross(p(d) - middle).dot(along) > 0 ? 1 : -1;
        const double area = 0.5 * turn * (f.cross(o - middle) + (o - middle).cross(g)).dot(along);
        const double length = (p(b) - p(a)).norm();
        EXPECT_NEAR(L(a, b), -area / length, 1e-9 * (1 + std::abs(area / length)));
        sum -= L(a, b) * length * length;
      }
    EXPECT_NEAR(sum, 3 * std::abs(volume),
                1e-8 * (1 + o.squaredNorm()));  // pyramids over the areas fill the tet
    EXPECT_LT(L.rowwise().sum().cwiseAbs().maxCoeff(), 1e-9 * (1 + L.cwiseAbs().maxCoeff()));
  }
}

TEST(FiniteVolumes, OfCubesAreSevenPoints) {
  // Of Kuhn's split: diagonals bound no area, so what is left is a difference quotient along each axis.
  const TetMesh mesh = test::box_mesh({4, 4, 4}, 2);
  double share = 1;
  const SparseMatrix L = finite_volumes(mesh.V, mesh.T, {}, &share);
  EXPECT_EQ(share, 0);
  const Eigen::MatrixXd all = dense(L);
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    if ((mesh.V.row(n).array() <= 0).any() || (mesh.V.row(n).array() >= 8).any()) continue;
    for (Eigen::Index m = 0; m < mesh.V.rows(); ++m) {
      const double distance = (mesh.V.row(n) - mesh.V.row(m)).norm();
      const double expected = m == n ? 12 : std::abs(distance - 2) < 1e-9 ? -2 : 0;
      EXPECT_NEAR(all(n, m), expected, 1e-12) << n << ' ' << m;
    }
  }
}

TEST(FiniteVolumes, ConductivityOfAnEdgeIsItsTetsMean) {
  const TetMesh mesh = test::box_mesh({3, 2, 2}, 2);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> draw(0.1, 9);
  std::vector<double> a(static_cast<std::size_t>(mesh.T.rows()));
  for (double& x : a) x = draw(random);
  const Eigen::MatrixXd plain = dense(finite_volumes(mesh.V, mesh.T, {}, nullptr));
  const Eigen::MatrixXd found = dense(finite_volumes(mesh.V, mesh.T, a, nullptr));
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    for (Eigen::Index m = 0; m < mesh.V.rows(); ++m) {
      if (m == n) continue;
      double sum = 0, count = 0;
      for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
        if ((mesh.T.row(t).array() == n).any() && (mesh.T.row(t).array() == m).any()) {
          sum += a[static_cast<std::size_t>(t)];
          ++count;
        }
      EXPECT_NEAR(found(n, m), count == 0 ? 0 : plain(n, m) * sum / count, 1e-12);
    }
  }
  EXPECT_LT(found.rowwise().sum().cwiseAbs().maxCoeff(), 1e-11);
}

TEST(Stiffness, IsOfElementsUnlessOnlyFiniteVolumesAreMonotone) {
  double share = 1;
  const TetMesh even = test::box_mesh({3, 3, 3}, 10);  // both are: elements
  EXPECT_EQ(dense(stiffness(even.V, even.T, {}, &share)), dense(laplacian(even.V, even.T, nullptr)));
  EXPECT_EQ(share, 0);
  const TetMesh shaken = test::shaken_box(4, 3);  // neither is: elements, and the share is theirs
  double of_elements = 0;
  const Eigen::MatrixXd expected = dense(laplacian(shaken.V, shaken.T, &of_elements));
  EXPECT_EQ(dense(stiffness(shaken.V, shaken.T, {}, &share)), expected);
  EXPECT_EQ(share, of_elements);
  EXPECT_GT(share, 0);
  // Two pyramids on a square: its diagonal pushes by elements and bounds no area. (A
  // lattice that does both is in unit_tet.)
  Points V(6, 3);
  V << 0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 1, 1, 2, 1, 1, -2;
  Tets T(4, 4);
  T << 0, 1, 2, 4, 0, 2, 3, 4, 0, 2, 1, 5, 0, 3, 2, 5;
  const Eigen::MatrixXd L = dense(stiffness(V, T, {}, &share));
  EXPECT_EQ(share, 0);
  EXPECT_GT(dense(laplacian(V, T, nullptr))(0, 2), 0.01);
  EXPECT_NEAR(L(0, 2), 0, 1e-12);
}

}  // namespace
}  // namespace ecorche::weights
