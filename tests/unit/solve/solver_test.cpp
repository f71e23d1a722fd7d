// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "core/solve/spd_solver.hpp"

namespace ecorche::solve {
namespace {

/// The Laplacian of a random graph plus a little of the identity, lower triangle.
SparseMatrix random_spd(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> any(0, n - 1);
  std::uniform_real_distribution<double> tie(0.1, 2.0);
  std::vector<Eigen::Triplet<double, std::int32_t>> entries;
  for (int i = 0; i < n; ++i) entries.emplace_back(i, i, 0.01);
  for (int e = 0; e < 5 * n; ++e) {
    const int i = any(random), j = any(random);
    if (i == j) continue;
    const double w = tie(random);
    entries.emplace_back(std::max(i, j), std::min(i, j), -w);
    entries.emplace_back(i, i, w);
    entries.emplace_back(j, j, w);
  }
  SparseMatrix A(n, n);
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

TEST(EigenSolver, AgreesWithADenseSolution) {
  const SparseMatrix A = random_spd(200, 7);
  const Block B = Block::Random(200, 5);
  const auto solver = make_eigen_solver();
  solver->factor(A, {});
  const Block X = solver->solve(B, {});
  const Eigen::MatrixXd dense = Eigen::MatrixXd(A).selfadjointView<Eigen::Lower>();
  EXPECT_LT((X - dense.llt().solve(B)).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT(relative_residual(A, X, B), 1e-12);
  EXPECT_EQ(solver->name(), "eigen");
}

TEST(EigenSolver, AnswersAgainAfterAnotherFactor) {
  const auto solver = make_eigen_solver();
  const Block B = Block::Random(50, 2);
  for (const unsigned seed : {1U, 2U}) {
    const SparseMatrix A = random_spd(50, seed);
    solver->factor(A, {});
    EXPECT_LT(relative_residual(A, solver->solve(B, {}), B), 1e-12);
  }
}

TEST(EigenSolver, RefusesAnIndefiniteMatrix) {
  SparseMatrix A = random_spd(20, 3);
  A.coeffRef(4, 4) = -1;
  const auto solver = make_eigen_solver();
  try {
    solver->factor(A, {});
    FAIL() << "an indefinite matrix was factored";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_NE(error.problem().find("20 unknowns is not positive definite"), std::string::npos)
        << error.what();
  }
  EXPECT_THROW(solver->solve(Block::Zero(20, 1), {}), Error);
}

TEST(RelativeResidual, IsTheWorstColumns) {
  SparseMatrix A(2, 2);
  A.insert(0, 0) = 2;
  A.insert(1, 1) = 4;
  Block X(2, 2), B(2, 2);
  X << 1, 1, 0, 1;
  B << 2, 2, 0, 3;  // the second column is off by (0, 1)
  EXPECT_DOUBLE_EQ(relative_residual(A, X, B), 1 / std::sqrt(13.0));
}

}  // namespace
}  // namespace ecorche::solve
