// SPDX-License-Identifier: Apache-2.0
// Right-hand sides of which few rows have numbers, against the same as whole blocks.
#include "core/solve/sparse_block.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "core/solve/spd_solver.hpp"

namespace ecorche::solve {
namespace {

// A chain whose ends and middle are pulled at.
constexpr int kUnknowns = 3000, kColumns = 5;

SparseMatrix chain() {
  SparseMatrix A(kUnknowns, kUnknowns);
  for (int i = 0; i < kUnknowns; ++i) {
    A.insert(i, i) = 2.01;
    if (i + 1 < kUnknowns) A.insert(i + 1, i) = -1;
  }
  return A;
}

Block pulled() {
  Block B = Block::Zero(kUnknowns, kColumns);
  for (const int row : {0, 1, kUnknowns / 2, kUnknowns - 1}) B.row(row).setRandom();
  B.row(7)(3) = 1e-300;
  return B;
}

TEST(SparseBlock, IsTheBlockItWasMadeOf) {
  const Block all = pulled();
  const SparseBlock sparse(all);
  EXPECT_EQ(sparse.rows(), kUnknowns);
  EXPECT_EQ(sparse.cols(), kColumns);
  EXPECT_EQ(sparse.whole(), all);
  EXPECT_EQ(sparse.row(2), nullptr);
  ASSERT_NE(sparse.row(7), nullptr);
  EXPECT_EQ(sparse.row(7)[3], 1e-300);
  EXPECT_EQ(SparseBlock(Block::Zero(3, 2)).whole(), Block::Zero(3, 2));
}

TEST(SparseBlock, IsSolvedAsTheWholeOne) {
  const Block B = pulled();
  for (const auto& make : {+[] { return make_eigen_solver(); }, +[] { return make_multigrid_solver(); }}) {
    const std::unique_ptr<SpdSolver> solver = make();
    solver->factor(chain(), {});
    const Block X = solver->solve(SparseBlock(B), {});
    EXPECT_EQ(X, solver->solve(B, {})) << solver->name();
    EXPECT_LT(relative_residual(chain(), X, B), 1e-10) << solver->name();
  }
}

}  // namespace
}  // namespace ecorche::solve
