// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <random>
#include <string>
#include <thread>

#include "preprocess/weights/harmonic.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::weights {
namespace {

using solve::SparseMatrix;

TEST(Solvers, AreChosenByNameAndAgree) {
  EXPECT_EQ(make_solver("auto")->name(), solver_names().front());
  EXPECT_EQ(solver_for(1000), solver_names().front());
  EXPECT_EQ(solver_for(2'000'000), "amg");
  try {
    make_solver("magic");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(error.what()).find("this build has no solver 'magic'"), std::string::npos)
        << error.what();
    EXPECT_NE(error.mend().find("eigen"), std::string::npos);
  }
  const TetMesh mesh = test::shaken_box(9, 2);
  const SparseMatrix L = laplacian(mesh.V, mesh.T, nullptr);
  std::vector<std::uint8_t> fixed(static_cast<std::size_t>(mesh.V.rows()), 0);
  Eigen::MatrixXd boundary = Eigen::MatrixXd::Zero(mesh.V.rows(), 3);
  std::mt19937 random(9);
  for (int i = 0; i < 40; ++i) {
    const std::size_t n = random() % fixed.size();
    fixed[n] = 1;
    boundary(static_cast<Eigen::Index>(n), i % 3) = 1;
  }
  const auto first = make_solver(solver_names().front());
  const HarmonicResult a = solve_harmonic(L, fixed, boundary, *first, {});
  for (const std::string_view name : solver_names()) {
    const HarmonicResult b = solve_harmonic(L, fixed, boundary, *make_solver(name), {});
    EXPECT_LT((a.values - b.values).cwiseAbs().maxCoeff(), 1e-10) << name;
  }
}

/// The shape stays, the numbers change; a refused matrix between them leaves nothing behind.
TEST(Solvers, FactorOtherNumbersOfTheSameShape) {
  const TetMesh mesh = test::shaken_box(6, 2);
  SparseMatrix first = laplacian(mesh.V, mesh.T, nullptr), second = first, bad = first;
  for (int c = 0; c < first.cols(); ++c) {
    first.coeffRef(c, c) += 1;
    second.coeffRef(c, c) += 30 + c;
  }
  bad.coeffRef(5, 5) = -1;
  const solve::Block B = solve::Block::Random(first.rows(), 2);
  for (const std::string_view name : solver_names()) {
    const auto solver = make_solver(name);
    solver->refactor(first, {});
    EXPECT_LT(solve::relative_residual(first, solver->solve(B, {}), B), 1e-10) << name;
    solver->refactor(second, {});
    EXPECT_LT(solve::relative_residual(second, solver->solve(B, {}), B), 1e-10) << name;
    EXPECT_THROW(solver->refactor(bad, {}), Error) << name;
    solver->refactor(first, {});
    EXPECT_LT(solve::relative_residual(first, solver->solve(B, {}), B), 1e-10) << name;
  }
}

TEST(Solvers, RefuseAMatrixThatIsNotDefinite) {
  const TetMesh mesh = test::box_mesh({3, 3, 3}, 10);
  SparseMatrix L = laplacian(mesh.V, mesh.T, nullptr);
  L.coeffRef(5, 5) = -1;
  for (const std::string_view name : solver_names()) {
    try {
      make_solver(name)->factor(L, {});
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::data) << error.what();
      EXPECT_NE(error.problem().find(" unknowns is not positive definite"), std::string::npos)
          << error.what();
      EXPECT_EQ(error.mend(), "look for degenerate tets and for parts of the mesh without a fixed node");
    }
  }
}

void our_handler(int) {}

TEST(Solvers, LeaveTheHandlerOfSigtermAlone) {
  // METIS_NodeND would not: it takes SIGTERM for its own errors while it orders.
  const TetMesh mesh = test::box_mesh({20, 20, 20}, 10);
  SparseMatrix A = laplacian(mesh.V, mesh.T, nullptr);
  for (Eigen::Index c = 0; c < A.cols(); ++c) A.coeffRef(c, c) += 1;
  struct sigaction ours {
  }, before{};
  ours.sa_handler = our_handler;
  sigaction(SIGTERM, &ours, &before);
  std::atomic<bool> done{false};
  std::thread work([&] {
    make_solver("auto")->factor(A, {});
    done = true;
  });
  bool kept = true;
  while (!done) {
    struct sigaction now {};
    sigaction(SIGTERM, nullptr, &now);
    kept = kept && now.sa_handler == our_handler;
  }
  work.join();
  EXPECT_TRUE(kept);
  sigaction(SIGTERM, &before, nullptr);
}

}  // namespace
}  // namespace ecorche::weights
