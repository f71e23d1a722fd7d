// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>
#include <set>

#include "core/solve/hierarchy.hpp"

namespace ecorche::solve {
namespace {

/// Seven points on a grid of n^3, fixed beyond its faces: the Laplacian of a cube, `stretch` times stiffer
/// along x.
SparseMatrix cube(int n, double stretch = 1) {
  std::vector<Eigen::Triplet<double, std::int32_t>> entries;
  const auto row = [&](int i, int j, int k) { return i + n * (j + n * k); };
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        entries.emplace_back(row(i, j, k), row(i, j, k), 4 + 2 * stretch);
        if (i > 0) entries.emplace_back(row(i, j, k), row(i - 1, j, k), -stretch);
        if (j > 0) entries.emplace_back(row(i, j, k), row(i, j - 1, k), -1);
        if (k > 0) entries.emplace_back(row(i, j, k), row(i, j, k - 1), -1);
      }
    }
  }
  SparseMatrix A(n * n * n, n * n * n);
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

Eigen::MatrixXd dense(const Csr<double>& A) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(A.rows, A.columns);
  for (std::int32_t row = 0; row < A.rows; ++row)
    A.for_row(row, [&](std::int32_t column, double value) { out(row, column) += value; });
  return out;
}

Csr<double> random_csr(int rows, int columns, unsigned seed) {
  std::mt19937 random(seed);
  Csr<double> out;
  out.rows = rows;
  out.columns = columns;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if (random() % 7 != 0) continue;
      out.column.push_back(c);
      out.value.push_back(static_cast<double>(random() % 1000) / 100 - 5);
    }
    out.first.push_back(static_cast<std::int64_t>(out.column.size()));
  }
  return out;
}

TEST(Csr, ProductsAndTransposesAreThoseOfDenseMatrices) {
  const Csr<double> A = random_csr(60, 41, 1), B = random_csr(41, 53, 2);
  EXPECT_LT((dense(multiply(A, B)) - dense(A) * dense(B)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(dense(transpose(A)), dense(A).transpose());
  const SparseMatrix lower = cube(4, 2);
  EXPECT_EQ(dense(both_triangles(lower)),
            Eigen::MatrixXd(Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>()));
  const std::vector<double> own = diagonal(both_triangles(lower));
  EXPECT_TRUE(std::all_of(own.begin(), own.end(), [](double x) { return x == 8; }));
}

TEST(Hierarchy, GroupsHoldWhatIsTied) {
  const Csr<double> A = both_triangles(cube(9));
  const std::vector<std::int32_t> group = aggregate(A, 0.08);
  const std::set<std::int32_t> groups(group.begin(), group.end());
  EXPECT_EQ(*groups.begin(), 0);  // all are tied
  EXPECT_EQ(groups.size(), static_cast<std::size_t>(*groups.rbegin()) + 1);
  EXPECT_LT(groups.size(), group.size() / 4);
  // Stiff along x: weak ties do not group. Rows of one group lie on one line.
  const std::vector<std::int32_t> lines = aggregate(both_triangles(cube(9, 1000)), 0.08);
  std::vector<std::int32_t> line_of(lines.size(), -1);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::int32_t& line = line_of[static_cast<std::size_t>(lines[i])];
    const auto own = static_cast<std::int32_t>(i / 9);
    if (line < 0) line = own;
    EXPECT_EQ(line, own);
  }
  // Tied to nothing: in no group.
  SparseMatrix loose(3, 3);
  for (int i = 0; i < 3; ++i) loose.insert(i, i) = 1;
  EXPECT_EQ(aggregate(both_triangles(loose), 0.08), (std::vector<std::int32_t>{-1, -1, -1}));
}

TEST(Hierarchy, ProlongatorsKeepConstantsAwayFromTheBorder) {
  constexpr int n = 9;
  const Csr<double> A = both_triangles(cube(n));
  const Csr<double> P = smoothed_prolongator(A, aggregate(A, 0.08), 0.08, largest_eigenvalue(A));
  for (int k = 1; k < n - 1; ++k) {
    for (int j = 1; j < n - 1; ++j) {
      for (int i = 1; i < n - 1; ++i) {
        double sum = 0;
        P.for_row(i + n * (j + n * k), [&](std::int32_t, double value) { sum += value; });
        EXPECT_NEAR(sum, 1, 1e-12);
      }
    }
  }
}

TEST(Hierarchy, TheLargestEigenvalueIsHeldFromAbove) {
  for (const double stretch : {1.0, 30.0}) {
    const Csr<double> A = both_triangles(cube(6, stretch));
    const Eigen::MatrixXd scaled = dense(A) / (4 + 2 * stretch);
    const double exact = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues().maxCoeff();
    EXPECT_GT(largest_eigenvalue(A), 0.97 * exact);
    EXPECT_LT(largest_eigenvalue(A), 1.15 * exact);
  }
}

TEST(MultigridSolver, AgreesWithADenseSolution) {
  const SparseMatrix A = cube(11, 3);           // 1331 unknowns: two levels
  const Block B = Block::Random(A.rows(), 21);  // more than one block of columns
  const auto solver = make_multigrid_solver();
  solver->factor(A, {});
  const Block X = solver->solve(B, {});
  const Eigen::MatrixXd full = Eigen::MatrixXd(A).selfadjointView<Eigen::Lower>();
  EXPECT_LT((X - full.llt().solve(B)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT(relative_residual(A, X, B), 1e-10);
  EXPECT_EQ(solver->name(), "amg");
  EXPECT_TRUE((solver->solve(Block::Zero(A.rows(), 2), {}).array() == 0).all());
}

// The time for more unknowns must not grow by more iterations.
TEST(MultigridSolver, ManyUnknownsAndTheSameBitsForAnyThreads) {
  const SparseMatrix A = cube(40);
  const Block B = Block::Random(A.rows(), 3);
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 4);
  Block one, four;
  const auto run = [&](int threads, Block& X) {
    tbb::task_arena(threads).execute([&] {
      const auto solver = make_multigrid_solver();
      solver->factor(A, {});
      X = solver->solve(B, {});
    });
  };
  run(1, one);
  run(4, four);
  EXPECT_LT(relative_residual(A, one, B), 1e-10);
  EXPECT_TRUE(one == four);
}

TEST(MultigridSolver, IsContentWithTheToleranceThatIsGiven) {
  const SparseMatrix A = cube(20, 3);
  const Block B = Block::Random(A.rows(), 3);
  const auto solver = make_multigrid_solver(0.01);
  solver->factor(A, {});
  const double residual = relative_residual(A, solver->solve(B, {}), B);
  EXPECT_LT(residual, 0.02);
  EXPECT_GT(residual, 1e-5) << "more work than asked for";
}

TEST(MultigridSolver, RefusesAnIndefiniteMatrix) {
  SparseMatrix A = cube(5);
  A.coeffRef(4, 4) = -1;
  const auto solver = make_multigrid_solver();
  try {
    solver->factor(A, {});
    FAIL() << "an indefinite matrix was factored";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_NE(error.problem().find("125 unknowns is not positive definite"), std::string::npos)
        << error.what();
  }
  try {
    solver->solve(Block::Zero(125, 1), {});
    FAIL() << "solved without a factor";
  } catch (const Error& error) {
    EXPECT_NE(error.problem().find("solve before factor"), std::string::npos) << error.what();
  }

  // A diagonal that hides it.
  SparseMatrix hidden = cube(12);
  for (int i = 1; i < 1700; ++i) hidden.coeffRef(i, i - 1) = -5;
  EXPECT_THROW(
      {
        solver->factor(hidden, {});
        solver->solve(Block::Random(hidden.rows(), 1), {});
      },
      Error);
}

}  // namespace
}  // namespace ecorche::solve
