// SPDX-License-Identifier: Apache-2.0
#include <Eigen/SparseCholesky>
#include <memory>

#include "core/solve/spd_solver.hpp"

namespace ecorche::solve {
namespace {

class EigenSolver final : public SpdSolver {
 public:
  std::string_view name() const override { return "eigen"; }

  void factor(const SparseMatrix& A, const Context& context) override {
    take(std::make_shared<State>(), A, context, [](State& state) { state.cholesky.compute(state.A); });
  }

  void refactor(const SparseMatrix& A, const Context& context) override {
    if (!state_) return factor(A, context);
    take(std::move(state_), A, context, [](State& state) { state.cholesky.factorize(state.A); });
  }

  using SpdSolver::solve;
  Block solve(const Block& B, const Context& context) const override {
    if (!state_) throw Error(ErrorKind::internal, "solver eigen", "solve before factor", "report it");
    auto rhs = std::make_shared<Block>(B);
    auto X = std::make_shared<Block>();
    context.run_unstoppable([state = state_, rhs, X] { *X = state->cholesky.solve(*rhs); });
    return std::move(*X);
  }

 private:
  /// Shared with a factorization that may outlive this object (Context::run_apart).
  struct State {
    SparseMatrix A;
    Eigen::SimplicialLLT<SparseMatrix, Eigen::Lower, Eigen::AMDOrdering<std::int32_t>> cholesky;
  };

  void take(std::shared_ptr<State> state, const SparseMatrix& A, const Context& context,
            void (*work)(State&)) {
    state->A = A;
    state_ = nullptr;
    context.run_unstoppable([state, work] { work(*state); });
    if (state->cholesky.info() != Eigen::Success) {
      throw Error(ErrorKind::data, "solver eigen",
                  "the matrix of " + std::to_string(A.rows()) + " unknowns is not positive definite",
                  "look for degenerate tets and for parts of the mesh without a fixed node");
    }
    state->A = SparseMatrix();
    state_ = std::move(state);
  }

  std::shared_ptr<State> state_;
};

}  // namespace

std::unique_ptr<SpdSolver> make_eigen_solver() {
  return std::make_unique<EigenSolver>();
}

}  // namespace ecorche::solve
