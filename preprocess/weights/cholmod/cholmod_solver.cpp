// SPDX-License-Identifier: AGPL-3.0-or-later
#include "preprocess/weights/cholmod/cholmod_solver.hpp"

#include <cholmod.h>

#include <algorithm>
#include <memory>
#include <string>

#include "core/solve/spd_solver.hpp"

extern "C" {
int openblas_get_num_threads();
void openblas_set_num_threads(int threads);
int omp_get_max_active_levels();
void omp_set_max_active_levels(int levels);
}

namespace ecorche::weights {
namespace {

using solve::Block;
using solve::SparseMatrix;

[[noreturn]] void fail(ErrorKind kind, const std::string& what, const std::string& mend) {
  throw Error(kind, "solver cholmod", what, mend);
}

/// CHOLMOD's workspace and the factor in it; shared with work that may outlive the solver
/// (Context::run_apart).
struct State {
  cholmod_common common{};
  cholmod_factor* factor = nullptr;

  State() {
    cholmod_start(&common);
    common.print = 0;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.final_ll = 1;
    common.nmethods = 1;
    // METIS by way of CHOLMOD's own nested dissection: the same fill in the same time (290 k unknowns: 1.33e8
    // against 1.32e8 entries, 4.2 against 4.0 s), but METIS_NodeND takes SIGTERM for its own errors while it
    // runs, and dies of one from outside.
    common.method[0].ordering = CHOLMOD_NESDIS;
  }
  ~State() {
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void check(Eigen::Index unknowns) const {
    const std::string size = "the matrix of " + std::to_string(unknowns) + " unknowns ";
    if (common.status == CHOLMOD_NOT_POSDEF || (factor != nullptr && factor->minor < factor->n)) {
      fail(ErrorKind::data, size + "is not positive definite",
           "look for degenerate tets and for parts of the mesh without a fixed node");
    }
    if (common.status == CHOLMOD_OUT_OF_MEMORY || common.status == CHOLMOD_TOO_LARGE) {
      fail(ErrorKind::data, size + "has a factor that does not fit",
           "prepare with fewer nodes: --max-nodes, --max-tets or --voxel");
    }
    if (common.status < CHOLMOD_OK) {
      fail(ErrorKind::internal, "status " + std::to_string(common.status), "report it");
    }
  }
};

/// While it lives neither OpenBLAS nor CHOLMOD's own loops (OpenMP, four threads on any machine) start
/// threads; then both are as they were.
class OneThread {
 public:
  OneThread() {
    openblas_set_num_threads(1);
    omp_set_max_active_levels(0);
  }
  ~OneThread() {
    omp_set_max_active_levels(levels_);
    openblas_set_num_threads(blas_);
  }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  int blas_ = openblas_get_num_threads(), levels_ = omp_get_max_active_levels();
};

/// A view of `A`, lower triangle, without a copy.
cholmod_sparse view(SparseMatrix& A) {
  cholmod_sparse v{};
  v.nrow = static_cast<std::size_t>(A.rows());
  v.ncol = static_cast<std::size_t>(A.cols());
  v.nzmax = static_cast<std::size_t>(A.nonZeros());
  v.p = A.outerIndexPtr();
  v.i = A.innerIndexPtr();
  v.x = A.valuePtr();
  v.stype = -1;
  v.itype = CHOLMOD_INT;
  v.xtype = CHOLMOD_REAL;
  v.dtype = CHOLMOD_DOUBLE;
  v.sorted = 1;
  v.packed = 1;
  return v;
}

class CholmodSolver final : public solve::SpdSolver {
 public:
  std::string_view name() const override { return "cholmod"; }

  void factor(const SparseMatrix& A, const Context& context) override {
    auto state = std::make_shared<State>();
    auto matrix = std::make_shared<SparseMatrix>(A);
    matrix->makeCompressed();
    state_ = nullptr;
    context.run_unstoppable([state, matrix] {
      cholmod_sparse a = view(*matrix);
      state->factor = cholmod_analyze(&a, &state->common);
      if (state->common.status == CHOLMOD_NOT_INSTALLED) {
        state->common.method[0].ordering = CHOLMOD_AMD;
        state->factor = cholmod_analyze(&a, &state->common);
      }
    });
    state->check(A.rows());
    fill(std::move(state), matrix, context);
  }

  void refactor(const SparseMatrix& A, const Context& context) override {
    if (!state_) return factor(A, context);
    auto matrix = std::make_shared<SparseMatrix>(A);
    matrix->makeCompressed();
    fill(std::move(state_), matrix, context);
  }

  using SpdSolver::solve;
  Block solve(const Block& B, const Context& context) const override {
    if (!state_) fail(ErrorKind::internal, "solve before factor", "report it");
    if (B.size() == 0) return B;
    auto rhs = std::make_shared<Eigen::MatrixXd>(B);  // CHOLMOD's are column by column
    auto X = std::make_shared<Eigen::MatrixXd>(B.rows(), B.cols());
    context.run_unstoppable([state = state_, rhs, X] {
      const OneThread one;
      cholmod_dense b{};
      b.nrow = b.d = static_cast<std::size_t>(rhs->rows());
      b.ncol = static_cast<std::size_t>(rhs->cols());
      b.nzmax = b.nrow * b.ncol;
      b.x = rhs->data();
      b.xtype = CHOLMOD_REAL;
      b.dtype = CHOLMOD_DOUBLE;
      cholmod_dense* x = cholmod_solve(CHOLMOD_A, state->factor, &b, &state->common);
      if (x == nullptr) return;  // told by the status
      std::copy_n(static_cast<const double*>(x->x), b.nzmax, X->data());
      cholmod_free_dense(&x, &state->common);
    });
    state_->check(B.rows());
    return *X;
  }

 private:
  /// The numbers of a factor whose shape is known.
  void fill(std::shared_ptr<State> state, const std::shared_ptr<SparseMatrix>& matrix,
            const Context& context) {
    state_ = nullptr;
    const auto unknowns = matrix->rows();
    context.run_unstoppable([state, matrix] {
      const OneThread one;
      cholmod_sparse a = view(*matrix);
      cholmod_factorize(&a, state->factor, &state->common);
    });
    state->check(unknowns);
    state_ = std::move(state);
  }

  std::shared_ptr<State> state_;
};

}  // namespace

std::unique_ptr<solve::SpdSolver> make_cholmod_solver() {
  return std::make_unique<CholmodSolver>();
}

}  // namespace ecorche::weights
