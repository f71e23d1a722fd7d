// SPDX-License-Identifier: Apache-2.0
// Residuals in double, corrected by conjugate gradients in float, preconditioned by one V-cycle of smoothed
// aggregation (Vanek, Mandel, Brezina 1996) with Chebyshev smoothers (Adams et al. 2003), all right-hand
// sides as blocks. Vectors are what costs: in float they are half as long, and nothing of the answer's
// accuracy is lost (Wilkinson 1963).
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <memory>

#include "core/solve/hierarchy.hpp"
#include "core/solve/spd_solver.hpp"
#include "core/solve/wide_rows.hpp"

namespace ecorche::solve {
namespace {

constexpr std::int32_t kCoarsest = 600;
// |r| over |b|. A small system is solved as well as a factor would, which costs nothing there. Of a large one
// the certificate asks 1e-8, and row sums that miss 1 by 1e-9 at most: they stay below 1e-10.
constexpr std::int32_t kSmall = 100'000;
constexpr double kTolerance = 2e-11, kSmallTolerance = 5e-13;
constexpr double kInner = 2e-6;  // by how much one correction in float shrinks the residual: two do
constexpr int kMostCorrections = 12;
constexpr int kMostIterations = 120;  // of one correction
constexpr double kSmoothed = 6;  // the smoother damps the eigenvalues from 1 / kSmoothed of the largest up

[[noreturn]] void not_definite(std::int32_t unknowns) {
  throw Error(ErrorKind::data, "solver amg",
              "the matrix of " + std::to_string(unknowns) + " unknowns is not positive definite",
              "look for degenerate tets and for parts of the mesh without a fixed node");
}

// Scaled on both sides so that the diagonal is 1: D^-1/2 A D^-1/2.
struct NarrowLevel {
  Csr<float> A, P, R;
  // Two steps of the Chebyshev iteration for A x = b, written out. From nothing: first b - second A b. Else
  // y = x + step (b - A x), then x = (1 + momentum) y - momentum x + damping (b - A y).
  float first = 0, second = 0, step = 0, momentum = 0, damping = 0;
};

using Space = RawVector<float>;  // a block, touched first by whoever fills it

// What a cycle writes, by level.
struct Scratch {
  std::vector<Space> x, b, r;
};

using Columns = std::array<double, kMostColumns>;

class MultigridSolver final : public SpdSolver {
 public:
  explicit MultigridSolver(double tolerance) : tolerance_(tolerance) {}

  std::string_view name() const override { return "amg"; }

  void factor(const SparseMatrix& A, const Context& context) override {
    ready_ = false;
    levels_.clear();
    A_ = both_triangles(A);
    own_ = diagonal(A_);
    for (const double own : own_) {
      if (!(own > 0)) not_definite(A_.rows);
    }
    const std::int32_t unknowns = A_.rows;
    std::vector<Level> levels = hierarchy(std::move(A_), kCoarsest, context);
    std::vector<double> fine = roots(own_);
    for (std::size_t at = 0; at < levels.size(); ++at) {
      Level& level = levels[at];
      NarrowLevel out;
      const std::vector<double> left = inverses(fine);
      out.A = scaled(level.A, left, left);
      if (at + 1 < levels.size()) {
        const std::vector<double> coarse = diagonal(levels[at + 1].A);
        for (const double own : coarse) {
          if (!(own > 0)) not_definite(unknowns);
        }
        std::vector<double> next = roots(coarse);
        out.P = scaled(level.P, fine, inverses(next));  // the scaled coarse to the scaled fine
        out.R = transpose(out.P);
        smooth_by(level.largest, out);
        fine = std::move(next);
      } else {
        coarsest_.compute(lower(level.A, left));
      }
      levels_.push_back(std::move(out));
      if (at == 0) A_ = std::move(level.A);
      level = {};
    }
    if (coarsest_.info() != Eigen::Success) not_definite(unknowns);
    ready_ = true;
  }

  Block solve(const Block& B, const Context& context) const override {
    return solve(SparseBlock(B), context);
  }

  Block solve(const SparseBlock& B, const Context& context) const override {
    if (!ready_) throw Error(ErrorKind::internal, "solver amg", "solve before factor", "report it");
    Block X(B.rows(), B.cols());
    for_parts(static_cast<std::size_t>(B.rows()), [&](std::size_t, std::size_t first, std::size_t past) {
      X.middleRows(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(past - first)).setZero();
    });
    const auto columns = static_cast<std::size_t>(B.cols());
    const std::size_t blocks = (columns + kMostColumns - 1) / kMostColumns;
    for (std::size_t block = 0; block < blocks; ++block) {
      const std::size_t begin = columns * block / blocks, end = columns * (block + 1) / blocks;
      solve_some(B, begin, end, X, context);
    }
    return X;
  }

 private:
  static std::vector<double> roots(const std::vector<double>& of) {
    std::vector<double> out(of.size());
    std::transform(of.begin(), of.end(), out.begin(), [](double x) { return std::sqrt(x); });
    return out;
  }
  static std::vector<double> inverses(const std::vector<double>& of) {
    std::vector<double> out(of.size());
    std::transform(of.begin(), of.end(), out.begin(), [](double x) { return 1 / x; });
    return out;
  }

  static void smooth_by(double largest, NarrowLevel& out) {
    const double high = largest, low = largest / kSmoothed;
    const double middle = (high + low) / 2, half = (high - low) / 2, sigma = middle / half;
    const double rho = 1 / sigma, next = 1 / (2 * sigma - rho);
    const double momentum = next * rho, damping = 2 * next / half;
    out.step = static_cast<float>(1 / middle);
    out.momentum = static_cast<float>(momentum);
    out.damping = static_cast<float>(damping);
    out.first = static_cast<float>((1 + momentum) / middle + damping);
    out.second = static_cast<float>(damping / middle);
  }

  // left_i a_ij left_j of the lower triangle.
  static SparseMatrix lower(const Csr<double>& A, const std::vector<double>& left) {
    std::vector<Eigen::Triplet<double, std::int32_t>> entries;
    for (std::int32_t row = 0; row < A.rows; ++row) {
      A.for_row(row, [&](std::int32_t column, double value) {
        const double factor = left[static_cast<std::size_t>(row)] * left[static_cast<std::size_t>(column)];
        if (column <= row) entries.emplace_back(row, column, factor * value);
      });
    }
    SparseMatrix out(A.rows, A.rows);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }

  static void combine_all(const Combination& job) {
    for_parts(static_cast<std::size_t>(job.A->rows),
              [&](std::size_t, std::size_t begin, std::size_t end) { combine(job, begin, end); });
  }

  void solve_coarsest(const float* b, float* x, std::size_t width) const {
    using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const auto rows = static_cast<Eigen::Index>(levels_.back().A.rows);
    const auto columns = static_cast<Eigen::Index>(width);
    const Eigen::MatrixXd wide = Eigen::Map<const Rows>(b, rows, columns).cast<double>();
    Eigen::Map<Rows>(x, rows, columns) = Eigen::MatrixXd(coarsest_.solve(wide)).cast<float>();
  }

  // x = about A^-1 b of the level; with the parts of x . b where they are asked for.
  void cycle(std::size_t at, const float* b, float* x, std::size_t width, Scratch& s,
             std::vector<Columns>* dots = nullptr) const {
    const NarrowLevel& level = levels_[at];
    if (at + 1 == levels_.size()) {
      solve_coarsest(b, x, width);
      for_parts(dots == nullptr ? 0 : static_cast<std::size_t>(level.A.rows),
                [&](std::size_t part, std::size_t begin, std::size_t end) {
                  add_dots(x, b, width, begin, end, (*dots)[part].data());
                });
      return;
    }
    float* const r = s.r[at].data();
    combine_all({&level.A, b, -level.second, {{{b, level.first}}}, x, width});
    combine_all({&level.A, x, -1, {{{b, 1}}}, r, width});
    combine_all({&level.R, r, 1, {}, s.b[at + 1].data(), width});
    cycle(at + 1, s.b[at + 1].data(), s.x[at + 1].data(), width, s);
    combine_all({&level.P, s.x[at + 1].data(), 1, {{{x, 1}}}, x, width});
    combine_all({&level.A, x, -level.step, {{{x, 1}, {b, level.step}}}, r, width});
    const Combination last{
        &level.A, r,    -level.damping, {{{r, 1 + level.momentum}, {x, -level.momentum}, {b, level.damping}}},
        x,        width};
    for_parts(static_cast<std::size_t>(level.A.rows),
              [&](std::size_t part, std::size_t begin, std::size_t end) {
                combine(last, begin, end);
                if (dots != nullptr) add_dots(x, b, width, begin, end, (*dots)[part].data());
              });
  }

  // Sums that parts of the rows left, in one order.
  static Columns total(const std::vector<Columns>& parts) {
    Columns out{};
    for (const Columns& part : parts) {
      for (std::size_t c = 0; c < kMostColumns; ++c) out[c] += part[c];
    }
    return out;
  }

  // r = D^-1/2 (B - A X) of columns begin .. end, each scaled to unit length; returns the squared lengths of
  // the unscaled.
  Columns residual(const SparseBlock& B, const Block& X, std::size_t begin, std::size_t end,
                   std::size_t width, Space& r) const {
    const auto rows = static_cast<std::size_t>(A_.rows), all = static_cast<std::size_t>(B.cols());
    std::vector<Columns> parts((rows + kRowsAtOnce - 1) / kRowsAtOnce);
    for_parts(rows, [&](std::size_t part, std::size_t first, std::size_t last) {
      for (std::size_t row = first; row < last; ++row) {
        Columns sum{};
        if (const double* const b = B.row(row)) std::copy(b + begin, b + end, sum.begin());
        A_.for_row(static_cast<std::int32_t>(row), [&](std::int32_t column, double a) {
          const double* const x = X.data() + static_cast<std::size_t>(column) * all;
          for (std::size_t c = begin; c < end; ++c) sum[c - begin] -= a * x[c];
        });
        const double left = 1 / std::sqrt(own_[row]);
        for (std::size_t c = 0; c < end - begin; ++c) {
          const double scaled = left * sum[c];
          parts[part][c] += scaled * scaled;
          r[row * width + c] = static_cast<float>(scaled);
        }
      }
    });
    return total(parts);
  }

  // Conjugate gradients for A x = r, until every column's squared length is below its goal; r is used up.
  void correct(Space& r, const Columns& goal, std::size_t width, Space& x, Space& p, Space& z, Scratch& s,
               const Context& context) const {
    const auto rows = static_cast<std::size_t>(A_.rows);
    float* const q = s.r[0].data();  // the cycle is done with it when the product begins
    std::vector<Columns> sums((rows + kRowsAtOnce - 1) / kRowsAtOnce);
    const auto clear = [&] { std::fill(sums.begin(), sums.end(), Columns{}); };
    const auto met = [&](const Columns& r2) {
      bool all = true;
      for (std::size_t c = 0; c < width; ++c) all = all && r2[c] <= goal[c];
      return all;
    };
    for_parts(rows, [&](std::size_t part, std::size_t begin, std::size_t end) {
      add_dots(r.data(), r.data(), width, begin, end, sums[part].data());
      std::fill(x.begin() + static_cast<std::ptrdiff_t>(begin * width),
                x.begin() + static_cast<std::ptrdiff_t>(end * width), 0.0F);
      std::fill(p.begin() + static_cast<std::ptrdiff_t>(begin * width),
                p.begin() + static_cast<std::ptrdiff_t>(end * width), 0.0F);
    });
    Columns r2 = total(sums), rz{};
    for (int i = 0; !met(r2); ++i) {
      context.check_stop();
      if (i == kMostIterations) not_definite(A_.rows);
      clear();
      cycle(0, r.data(), z.data(), width, s, &sums);
      const Columns now = total(sums);
      std::array<float, kMostColumns> beta{}, step{};
      for (std::size_t c = 0; c < width; ++c) {
        if (rz[c] != 0) beta[c] = static_cast<float>(now[c] / rz[c]);
      }
      for_parts(rows, [&](std::size_t, std::size_t begin, std::size_t end) {
        turn(beta.data(), z.data(), p.data(), width, begin, end);
      });
      clear();
      const Combination product{&levels_[0].A, p.data(), 1, {}, q, width};
      for_parts(rows, [&](std::size_t part, std::size_t begin, std::size_t end) {
        combine(product, begin, end);
        add_dots(p.data(), q, width, begin, end, sums[part].data());
      });
      const Columns pq = total(sums);
      for (std::size_t c = 0; c < width; ++c) {
        if (r2[c] <= goal[c]) continue;
        if (!(pq[c] > 0)) not_definite(A_.rows);
        step[c] = static_cast<float>(now[c] / pq[c]);
      }
      clear();
      for_parts(rows, [&](std::size_t part, std::size_t begin, std::size_t end) {
        advance(step.data(), p.data(), q, x.data(), r.data(), width, begin, end);
        add_dots(r.data(), r.data(), width, begin, end, sums[part].data());
      });
      rz = now;
      r2 = total(sums);
    }
  }

  // Columns begin .. end of B. Each column is its own iteration; they share the matrix's traffic.
  void solve_some(const SparseBlock& B, std::size_t begin, std::size_t end, Block& X,
                  const Context& context) const {
    const auto rows = static_cast<std::size_t>(A_.rows), all = static_cast<std::size_t>(B.cols());
    const std::size_t width = (end - begin + kLanes - 1) / kLanes * kLanes;
    Scratch s;
    for (const NarrowLevel& level : levels_) {
      const std::size_t size = static_cast<std::size_t>(level.A.rows) * width;
      for (auto* each : {&s.x, &s.b}) each->emplace_back(s.r.empty() ? 0 : size);  // the finest are CG's own
      s.r.emplace_back(size);
    }
    Space x(rows * width), r(rows * width), p(rows * width), z(rows * width);
    for_parts(rows, [&](std::size_t, std::size_t first, std::size_t past) {  // columns beyond B's stay so
      std::fill(r.begin() + static_cast<std::ptrdiff_t>(first * width),
                r.begin() + static_cast<std::ptrdiff_t>(past * width), 0.0F);
    });
    const double tolerance = tolerance_ > 0 ? tolerance_ : A_.rows <= kSmall ? kSmallTolerance : kTolerance;
    Columns asked{}, last{};
    for (int correction = 0;; ++correction) {
      context.check_stop();
      const Columns r2 = residual(B, X, begin, end, width, r);
      if (correction == 0) asked = r2;
      bool done = true;
      Columns length{}, goal{};
      for (std::size_t c = 0; c < width; ++c) {
        const double target = tolerance * tolerance * asked[c];
        done = done && r2[c] <= target;
        // Each column to unit length: floats end at 1e-38.
        length[c] = std::sqrt(r2[c]);
        goal[c] = r2[c] > target ? std::max(kInner * kInner, 0.1 * target / r2[c]) : 2;
        if (correction > 0 && r2[c] > target && !(r2[c] < 0.25 * last[c])) not_definite(A_.rows);
      }
      if (done) return;
      if (correction == kMostCorrections) not_definite(A_.rows);
      last = r2;
      for_parts(rows, [&](std::size_t, std::size_t first, std::size_t past) {
        for (std::size_t row = first; row < past; ++row) {
          for (std::size_t c = 0; c < width; ++c) {
            float& value = r[row * width + c];
            value = length[c] > 0 ? static_cast<float>(value / length[c]) : 0.0F;
          }
        }
      });
      correct(r, goal, width, x, p, z, s, context);
      for_parts(rows, [&](std::size_t, std::size_t first, std::size_t past) {
        for (std::size_t row = first; row < past; ++row) {
          const double left = 1 / std::sqrt(own_[row]);
          for (std::size_t c = 0; c < end - begin; ++c) {
            X.data()[row * all + begin + c] += left * length[c] * static_cast<double>(x[row * width + c]);
          }
        }
      });
    }
  }

  const double tolerance_;  // 0: its own
  Csr<double> A_;
  std::vector<double> own_;  // the diagonal
  std::vector<NarrowLevel> levels_;
  Eigen::SimplicialLLT<SparseMatrix, Eigen::Lower, Eigen::AMDOrdering<std::int32_t>> coarsest_;
  bool ready_ = false;
};

}  // namespace

std::unique_ptr<SpdSolver> make_multigrid_solver(double tolerance) {
  return std::make_unique<MultigridSolver>(tolerance);
}

}  // namespace ecorche::solve
