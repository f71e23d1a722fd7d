// SPDX-License-Identifier: Apache-2.0
#include "core/solve/hierarchy.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ecorche::solve {
namespace {

constexpr double kStrength = 0.08;  // of Vanek; halved from level to level
constexpr std::size_t kMostLevels = 12;

// Which entries tie, and the filtered diagonal.
struct Ties {
  std::vector<double> own;  // a_ii
  double strength2;

  Ties(const Csr<double>& A, double strength) : own(diagonal(A)), strength2(strength * strength) {}
  bool strong(std::int32_t i, std::int32_t j, double a) const {
    return i != j && a * a > strength2 * own[static_cast<std::size_t>(i)] * own[static_cast<std::size_t>(j)];
  }
};

}  // namespace

std::vector<std::int32_t> aggregate(const Csr<double>& A, double strength) {
  constexpr std::int32_t kFree = -1;
  const Ties ties(A, strength);
  std::vector<std::int32_t> group(static_cast<std::size_t>(A.rows), kFree);
  const auto of = [&](std::int32_t i) -> std::int32_t& { return group[static_cast<std::size_t>(i)]; };
  std::int32_t groups = 0;
  for (std::int32_t i = 0; i < A.rows; ++i) {
    bool whole = of(i) == kFree, any = false;
    A.for_row(i, [&](std::int32_t j, double a) {
      if (!ties.strong(i, j, a)) return;
      any = true;
      whole = whole && of(j) == kFree;
    });
    if (!whole || !any) continue;
    of(i) = groups;
    A.for_row(i, [&](std::int32_t j, double a) {
      if (ties.strong(i, j, a)) of(j) = groups;
    });
    ++groups;
  }
  // Into the groups of the first pass, or of those that this pass made before.
  const std::vector<std::int32_t> first = group;
  for (std::int32_t i = 0; i < A.rows; ++i) {
    if (of(i) != kFree) continue;
    double most = 0;
    bool any = false;
    A.for_row(i, [&](std::int32_t j, double a) {
      if (!ties.strong(i, j, a)) return;
      any = true;
      if (first[static_cast<std::size_t>(j)] == kFree || std::abs(a) <= most) return;
      most = std::abs(a);
      of(i) = first[static_cast<std::size_t>(j)];
    });
    if (of(i) != kFree || !any) continue;
    of(i) = groups;
    A.for_row(i, [&](std::int32_t j, double a) {
      if (ties.strong(i, j, a) && of(j) == kFree) of(j) = groups;
    });
    ++groups;
  }
  return group;
}

Csr<double> smoothed_prolongator(const Csr<double>& A, const std::vector<std::int32_t>& group,
                                 double strength, double largest) {
  const Ties ties(A, strength);
  std::int32_t groups = 0;
  for (const std::int32_t g : group) groups = std::max(groups, g + 1);
  std::vector<RowsPart> parts(static_cast<std::size_t>((A.rows + RowsPart::rows - 1) / RowsPart::rows));
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) {
    RowsPart& part = parts[p];
    std::vector<std::pair<std::int32_t, double>> row;
    const auto add = [&](std::int32_t g, double value) {
      if (g < 0) return;
      const auto at =
          std::find_if(row.begin(), row.end(), [&](const auto& entry) { return entry.first == g; });
      if (at == row.end()) {
        row.emplace_back(g, value);
      } else {
        at->second += value;
      }
    };
    const auto begin = static_cast<std::int32_t>(p) * RowsPart::rows;
    for (std::int32_t i = begin; i < std::min(begin + RowsPart::rows, A.rows); ++i) {
      double own = 0;
      A.for_row(i, [&](std::int32_t j, double a) { own += ties.strong(i, j, a) ? 0 : a; });
      // A row whose filtered diagonal vanishes cannot be smoothed by itself.
      const double scale = own > 0 ? 4.0 / (3 * largest * own) : 0;
      row.clear();
      add(group[static_cast<std::size_t>(i)], 1 - scale * own);
      A.for_row(i, [&](std::int32_t j, double a) {
        if (ties.strong(i, j, a)) add(group[static_cast<std::size_t>(j)], -scale * a);
      });
      std::sort(row.begin(), row.end());
      for (const auto& [g, value] : row) {
        part.column.push_back(g);
        part.value.push_back(value);
      }
      part.length.push_back(static_cast<std::int32_t>(row.size()));
    }
  });
  return join(A.rows, groups, parts);
}

double largest_eigenvalue(const Csr<double>& A) {
  constexpr int kSteps = 15;
  const std::vector<double> own = diagonal(A);
  std::vector<double> x(own.size()), y(own.size());
  std::uint32_t state = 1;  // a start with a share of every mode
  for (double& value : x) {
    state = state * 1664525U + 1013904223U;
    value = 0.5 + static_cast<double>(state >> 8) / (1U << 24);
  }
  double estimate = 1, scale = 1;
  constexpr std::size_t kRows = 4096;
  struct Squares {
    double before = 0, after = 0;
  };
  std::vector<Squares> parts((x.size() + kRows - 1) / kRows);
  for (int step = 0; step < kSteps; ++step) {
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) {
      Squares sums;
      for (std::size_t i = p * kRows; i < std::min((p + 1) * kRows, x.size()); ++i) {
        double sum = 0;
        A.for_row(static_cast<std::int32_t>(i),
                  [&](std::int32_t j, double a) { sum += a * x[static_cast<std::size_t>(j)]; });
        y[i] = scale * sum / own[i];
        sums.before += x[i] * x[i];
        sums.after += y[i] * y[i];
      }
      parts[p] = sums;
    });
    Squares all;  // in one order
    for (const Squares& sums : parts) {
      all.before += scale * scale * sums.before;
      all.after += sums.after;
    }
    if (!(all.before > 0) || !(all.after > 0)) break;
    estimate = std::sqrt(all.after / all.before);
    scale = 1 / std::sqrt(all.after);
    std::swap(x, y);
  }
  return 1.1 * estimate;
}

std::vector<Level> hierarchy(Csr<double> A, std::int32_t coarsest, const Context& context) {
  std::vector<Level> out;
  double strength = kStrength;
  out.push_back({std::move(A), {}, 0});
  while (out.back().A.rows > coarsest && out.size() < kMostLevels) {
    context.check_stop();
    Level& fine = out.back();
    fine.largest = largest_eigenvalue(fine.A);
    Csr<double> P = smoothed_prolongator(fine.A, aggregate(fine.A, strength), strength, fine.largest);
    if (P.columns == 0 || P.columns >= fine.A.rows) break;
    Csr<double> coarse = multiply(transpose(P), multiply(fine.A, P));
    fine.P = std::move(P);
    out.push_back({std::move(coarse), {}, 0});
    strength /= 2;
  }
  return out;
}

}  // namespace ecorche::solve
