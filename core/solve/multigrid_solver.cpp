// SPDX-License-Identifier: Apache-2.0
// Conjugate gradients in double, preconditioned by one V-cycle of smoothed aggregation in float (Vanek,
// Mandel, Brezina 1996) with Chebyshev smoothers (Adams et al. 2003), all right-hand sides as blocks.
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <memory>

#include "core/solve/block_kernels.hpp"
#include "core/solve/hierarchy.hpp"
#include "core/solve/spd_solver.hpp"

namespace ecorche::solve {
namespace {

constexpr std::int32_t kCoarsest = 600;
constexpr double kTolerance = 2e-13;  // |r| over |b|
constexpr int kMostIterations = 300;
constexpr double kSmoothed = 8;  // the smoother damps the eigenvalues from 1 / kSmoothed of the largest up

[[noreturn]] void not_definite(std::int32_t unknowns) {
  throw Error(ErrorKind::data, "solver amg",
              "the matrix of " + std::to_string(unknowns) + " unknowns is not positive definite",
              "look for degenerate tets and for parts of the mesh without a fixed node");
}

struct NarrowLevel {
  Csr<float> A, P, R;
  std::vector<float> inverse;  // of the diagonal
  float low = 0, high = 0;     // what the smoother damps, of D^-1 A
};

// What a cycle writes, by level.
struct Scratch {
  std::vector<Rows<float>> x, b, r, step;
};

class MultigridSolver final : public SpdSolver {
 public:
  std::string_view name() const override { return "amg"; }

  void factor(const SparseMatrix& A, const Context& context) override {
    ready_ = false;
    levels_.clear();
    A_ = both_triangles(A);
    for (const double own : diagonal(A_)) {
      if (!(own > 0)) not_definite(A_.rows);
    }
    std::vector<Level> levels = hierarchy(A_, kCoarsest, context);
    for (Level& level : levels) {
      NarrowLevel out;
      for (const double own : diagonal(level.A)) out.inverse.push_back(static_cast<float>(1 / own));
      out.A = narrow(level.A);
      out.R = narrow(transpose(level.P));
      out.P = narrow(level.P);
      out.high = static_cast<float>(level.largest);
      out.low = static_cast<float>(level.largest / kSmoothed);
      if (&level == &levels.back()) coarsest_.compute(lower(level.A));
      levels_.push_back(std::move(out));
      level = {};
    }
    if (coarsest_.info() != Eigen::Success) not_definite(A_.rows);
    ready_ = true;
  }

  Block solve(const Block& B, const Context& context) const override {
    if (!ready_) throw Error(ErrorKind::internal, "solver amg", "solve before factor", "report it");
    Block X(B.rows(), B.cols());
    Scratch scratch;
    for (const NarrowLevel& level : levels_) {
      const auto rows = static_cast<std::size_t>(level.A.rows);
      for (auto* each : {&scratch.x, &scratch.b, &scratch.r, &scratch.step}) each->emplace_back(rows);
    }
    for (Eigen::Index first = 0; first < B.cols(); first += kWidth) solve_some(B, first, X, scratch, context);
    return X;
  }

 private:
  static SparseMatrix lower(const Csr<double>& A) {
    std::vector<Eigen::Triplet<double, std::int32_t>> entries;
    for (std::int32_t row = 0; row < A.rows; ++row) {
      A.for_row(row, [&](std::int32_t column, double value) {
        if (column <= row) entries.emplace_back(row, column, value);
      });
    }
    SparseMatrix out(A.rows, A.rows);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }

  // Two steps of the Chebyshev iteration for A x = b; `zero`: x is nothing yet.
  static void smooth(const NarrowLevel& level, const Rows<float>& b, bool zero, Rows<float>& x,
                     Rows<float>& r, Rows<float>& step) {
    const float middle = (level.high + level.low) / 2, half = (level.high - level.low) / 2;
    const float sigma = middle / half;
    float rho = 1 / sigma;
    if (!zero) residual(level.A, x, &b, r);
    for_rows(x.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const auto& from = zero ? b[row] : r[row];
        const float scale = level.inverse[row] / middle;
        for (std::size_t c = 0; c < kWidth; ++c) {
          step[row][c] = scale * from[c];
          x[row][c] = zero ? step[row][c] : x[row][c] + step[row][c];
        }
      }
    });
    residual(level.A, x, &b, r);
    const float next = 1 / (2 * sigma - rho);
    for_rows(x.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const float scale = 2 * next / half * level.inverse[row];
        for (std::size_t c = 0; c < kWidth; ++c) x[row][c] += next * rho * step[row][c] + scale * r[row][c];
      }
    });
  }

  // x = about A^-1 b of the level; b stays.
  void cycle(std::size_t at, Scratch& s) const {
    const NarrowLevel& level = levels_[at];
    if (at + 1 == levels_.size()) {
      Block b(level.A.rows, kWidth);
      for (Eigen::Index row = 0; row < b.rows(); ++row) {
        for (std::size_t c = 0; c < kWidth; ++c)
          b(row, static_cast<Eigen::Index>(c)) = s.b[at][static_cast<std::size_t>(row)][c];
      }
      const Block x = coarsest_.solve(b);
      for (Eigen::Index row = 0; row < b.rows(); ++row) {
        for (std::size_t c = 0; c < kWidth; ++c)
          s.x[at][static_cast<std::size_t>(row)][c] =
              static_cast<float>(x(row, static_cast<Eigen::Index>(c)));
      }
      return;
    }
    smooth(level, s.b[at], true, s.x[at], s.r[at], s.step[at]);
    residual(level.A, s.x[at], &s.b[at], s.r[at]);
    residual<float>(level.R, s.r[at], nullptr, s.b[at + 1]);
    cycle(at + 1, s);
    residual<float>(level.P, s.x[at + 1], nullptr, s.r[at]);
    for_each_row(s.x[at].size(), [&](std::size_t row, std::size_t c) { s.x[at][row][c] += s.r[at][row][c]; });
    smooth(level, s.b[at], false, s.x[at], s.r[at], s.step[at]);
  }

  // z = the cycle's answer to r, each column scaled to unit length first: floats end at 1e-38.
  void precondition(const Rows<double>& r, const std::array<double, kWidth>& r2, Rows<double>& z,
                    Scratch& s) const {
    std::array<double, kWidth> scale{}, back{};
    for (std::size_t c = 0; c < kWidth; ++c) {
      back[c] = std::sqrt(r2[c]);
      scale[c] = back[c] > 0 ? 1 / back[c] : 0;
    }
    for_each_row(r.size(), [&](std::size_t row, std::size_t c) {
      s.b[0][row][c] = static_cast<float>(scale[c] * r[row][c]);
    });
    cycle(0, s);
    for_each_row(r.size(), [&](std::size_t row, std::size_t c) {
      z[row][c] = back[c] * static_cast<double>(s.x[0][row][c]);
    });
  }

  static bool met(const std::array<double, kWidth>& r2, const std::array<double, kWidth>& goal) {
    bool all = true;
    for (std::size_t c = 0; c < kWidth; ++c) all = all && r2[c] <= goal[c];
    return all;
  }

  // Columns first .. first + kWidth of B. Each column is its own iteration; they share the matrix's traffic.
  void solve_some(const Block& B, Eigen::Index first, Block& X, Scratch& scratch,
                  const Context& context) const {
    const auto rows = static_cast<std::size_t>(B.rows());
    const auto width = static_cast<std::size_t>(std::min<Eigen::Index>(kWidth, B.cols() - first));
    Rows<double> x(rows), r(rows), z(rows), p(rows), q(rows);
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t c = 0; c < width; ++c)
        r[row][c] = B(static_cast<Eigen::Index>(row), first + static_cast<Eigen::Index>(c));
    }
    std::array<double, kWidth> r2 = dot(r, r), goal{}, rz{}, alpha{};
    for (std::size_t c = 0; c < kWidth; ++c) goal[c] = kTolerance * kTolerance * r2[c];
    for (int i = 0; !met(r2, goal); ++i) {
      context.check_stop();
      if (i == kMostIterations) not_definite(A_.rows);
      precondition(r, r2, z, scratch);
      // Polak-Ribiere: a cycle in float is not quite the same operator each time.
      const std::array<double, kWidth> now = dot(r, z), mixed = dot(q, z);
      std::array<double, kWidth> beta{};
      for (std::size_t c = 0; c < kWidth; ++c) {
        if (rz[c] != 0) beta[c] = -alpha[c] * mixed[c] / rz[c];
      }
      for_each_row(rows,
                   [&](std::size_t row, std::size_t c) { p[row][c] = z[row][c] + beta[c] * p[row][c]; });
      residual<double>(A_, p, nullptr, q);
      const std::array<double, kWidth> pq = dot(p, q);
      for (std::size_t c = 0; c < kWidth; ++c) {
        alpha[c] = 0;
        if (r2[c] <= goal[c]) continue;
        if (!(pq[c] > 0)) not_definite(A_.rows);
        alpha[c] = now[c] / pq[c];
      }
      for_each_row(rows, [&](std::size_t row, std::size_t c) {
        x[row][c] += alpha[c] * p[row][c];
        r[row][c] -= alpha[c] * q[row][c];
      });
      rz = now;
      r2 = dot(r, r);
    }
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t c = 0; c < width; ++c)
        X(static_cast<Eigen::Index>(row), first + static_cast<Eigen::Index>(c)) = x[row][c];
    }
  }

  Csr<double> A_;
  std::vector<NarrowLevel> levels_;
  Eigen::SimplicialLLT<SparseMatrix, Eigen::Lower, Eigen::AMDOrdering<std::int32_t>> coarsest_;
  bool ready_ = false;
};

}  // namespace

std::unique_ptr<SpdSolver> make_multigrid_solver() {
  return std::make_unique<MultigridSolver>();
}

}  // namespace ecorche::solve
