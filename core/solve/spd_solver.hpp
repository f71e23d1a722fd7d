// SPDX-License-Identifier: Apache-2.0
// Symmetric positive definite systems: factor once, solve for many right-hand sides as one block.
#pragma once

#include <Eigen/SparseCore>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/values/context.hpp>
#include "core/solve/sparse_block.hpp"

namespace ecorche::solve {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int32_t>;
/// A factored system. Backends: `eigen` and `amg` (here), `cholmod` (preprocess/weights/cholmod, GPL); chosen
/// by name.
class SpdSolver {
 public:
  virtual ~SpdSolver() = default;
  virtual std::string_view name() const = 0;
  /// Factors `A`, of which the lower triangle is read. Throws Error{data} when A is not positive definite.
  virtual void factor(const SparseMatrix& A, const Context& context) = 0;
  /// The same for a matrix whose entries stand where those of the last one stood: what depends on that alone
  /// is kept. After a refusal, and first of all, it is `factor`.
  virtual void refactor(const SparseMatrix& A, const Context& context) { factor(A, context); }
  /// Solves A X = B. Only after `factor`.
  virtual Block solve(const Block& B, const Context& context) const = 0;
  /// The same of right-hand sides that take less memory; less in some backends alone.
  virtual Block solve(const SparseBlock& B, const Context& context) const {
    return solve(B.whole(), context);
  }
};

using SpdSolverFactory = std::function<std::unique_ptr<SpdSolver>()>;

/// Simplicial LLT of Eigen: for small cases, tests and the build without GPL.
std::unique_ptr<SpdSolver> make_eigen_solver();

/// Conjugate gradients with smoothed-aggregation multigrid, all right-hand sides as blocks, to a relative
/// residual of 2e-11 (5e-13 up to 100 000 unknowns): for large meshes. O(unknowns) memory and about
/// O(unknowns) time; the same bits for any number of threads on one kind of processor. `solve` throws
/// Error{data} as well where the matrix turns out not to be positive definite. `tolerance`: another relative
/// residual to be content with, as where the system is an estimate itself; 0: these.
std::unique_ptr<SpdSolver> make_multigrid_solver(double tolerance = 0);

/// Largest over the columns of |A x - b| / |b|, A symmetric from its lower triangle.
double relative_residual(const SparseMatrix& A, const Block& X, const Block& B);

}  // namespace ecorche::solve
