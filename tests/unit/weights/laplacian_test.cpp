// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "preprocess/weights/harmonic.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::weights {
namespace {

using solve::SparseMatrix;

Eigen::MatrixXd full(const SparseMatrix& L) {
  return Eigen::MatrixXd(L).selfadjointView<Eigen::Lower>();
}

TEST(Laplacian, OfOneTetIsTheCotangentFormula) {
  Points V(4, 3);
  V << 0, 0, 0, 3, 0.5, 0, 1, 4, 0.2, 0.7, 1, 5;
  Tets T(1, 4);
  T << 0, 1, 2, 3;
  const Eigen::MatrixXd L = full(laplacian(V, T, nullptr));
  // L_ab = -(length of the opposite edge) cot(dihedral angle at that edge) / 6.
  const int edges[6][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2},
                           {1, 2, 0, 3}, {1, 3, 0, 2}, {2, 3, 0, 1}};
  for (const auto& e : edges) {
    const Eigen::Vector3d c = V.row(e[2]), d = V.row(e[3]);
    const Eigen::Vector3d axis = (d - c).normalized();
    const auto across = [&](int node) -> Eigen::Vector3d {
      const Eigen::Vector3d x = V.row(node).transpose() - c;
      return x - axis.dot(x) * axis;
    };
    const Eigen::Vector3d p = across(e[0]), q = across(e[1]);
    const double cotangent = p.dot(q) / p.cross(q).norm();
    EXPECT_NEAR(L(e[0], e[1]), -(d - c).norm() * cotangent / 6, 1e-12);
  }
  EXPECT_LT(L.rowwise().sum().cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Laplacian, EqualsTheSumOverTets) {
  const TetMesh mesh = test::shaken_box(4, 3);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(mesh.V.rows(), mesh.V.rows());
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    Eigen::Matrix4d corners;
    for (Eigen::Index k = 0; k < 4; ++k) corners.row(k) << mesh.V.row(mesh.T(t, k)), 1;
    // Barycentrics are the affine functions that are 1 at one corner: columns of the inverse.
    const Eigen::Matrix4d inverse = corners.inverse();
    const Eigen::Matrix<double, 3, 4> gradients = inverse.topRows<3>();
    const double volume = corners.determinant() / -6;
    ASSERT_GT(volume, 0);
    for (Eigen::Index a = 0; a < 4; ++a) {
      for (Eigen::Index b = 0; b < 4; ++b) {
        expected(mesh.T(t, a), mesh.T(t, b)) += volume * gradients.col(a).dot(gradients.col(b));
      }
    }
  }
  const SparseMatrix L = laplacian(mesh.V, mesh.T, nullptr);
  EXPECT_LT((full(L) - expected).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT(full(L).rowwise().sum().cwiseAbs().maxCoeff(), 1e-10);
  ASSERT_TRUE(L.isCompressed());
  for (Eigen::Index c = 0; c < L.cols(); ++c) {
    Eigen::Index last = -1;
    for (SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
      EXPECT_GE(entry.row(), c);  // lower triangle
      EXPECT_GT(entry.row(), last);
      last = entry.row();
    }
  }
}

TEST(Laplacian, CountsPositiveOffDiagonals) {
  double share = -1;
  const TetMesh even = test::box_mesh({3, 3, 3}, 10);
  laplacian(even.V, even.T, &share);
  EXPECT_EQ(share, 0);
  const TetMesh shaken = test::shaken_box(4, 3);
  const SparseMatrix L = laplacian(shaken.V, shaken.T, &share);
  int positive = 0, all = 0;
  for (Eigen::Index c = 0; c < L.cols(); ++c) {
    for (SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
      if (entry.row() == c) continue;
      ++all;
      positive += entry.value() > 1e-9;
    }
  }
  EXPECT_GT(positive, 0);
  EXPECT_DOUBLE_EQ(share, static_cast<double>(positive) / all);
}

TEST(Laplacian, RefusesATetWithoutVolume) {
  TetMesh mesh = test::box_mesh({1, 1, 1}, 10);
  std::swap(mesh.T(2, 0), mesh.T(2, 1));
  try {
    laplacian(mesh.V, mesh.T, nullptr);
    FAIL() << "an inverted tet passed";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_NE(error.problem().find("tet 2 has the volume -"), std::string::npos) << error.what();
  }
}

TEST(Harmonic, ReproducesLinearFunctionsExactly) {
  const TetMesh mesh = test::shaken_box(6, 2);
  const SparseMatrix L = laplacian(mesh.V, mesh.T, nullptr);
  Eigen::MatrixXd linear(mesh.V.rows(), 2);
  linear.col(0) = mesh.V * Eigen::Vector3d(0.3, -1, 2);
  linear.col(1) = mesh.V * Eigen::Vector3d(1, 1, -0.5) + Eigen::VectorXd::Constant(mesh.V.rows(), 7);
  std::vector<std::uint8_t> fixed(static_cast<std::size_t>(mesh.V.rows()), 0);
  Eigen::MatrixXd boundary = Eigen::MatrixXd::Zero(mesh.V.rows(), 2);
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    if ((mesh.V.row(n).array() > 0).all() && (mesh.V.row(n).array() < 60).all()) continue;
    fixed[static_cast<std::size_t>(n)] = 1;
    boundary.row(n) = linear.row(n);
  }
  for (const std::string_view name : solver_names()) {
    const auto solver = make_solver(name);
    const HarmonicResult result = solve_harmonic(L, fixed, boundary, *solver, {});
    EXPECT_LT((result.values - linear).cwiseAbs().maxCoeff(), 1e-10) << name;
    EXPECT_LT(result.residual, 1e-12);
  }
}

TEST(Harmonic, NeedsAFixedNode) {
  const TetMesh mesh = test::box_mesh({2, 2, 2}, 10);
  const SparseMatrix L = laplacian(mesh.V, mesh.T, nullptr);
  const std::vector<std::uint8_t> none(static_cast<std::size_t>(mesh.V.rows()), 0);
  const auto solver = make_solver("eigen");
  expect_error(ErrorKind::data, "weights: no node is fixed (the mesh must touch at least one bone)",
               [&] { solve_harmonic(L, none, Eigen::MatrixXd::Zero(mesh.V.rows(), 1), *solver, {}); });
}

}  // namespace
}  // namespace ecorche::weights
