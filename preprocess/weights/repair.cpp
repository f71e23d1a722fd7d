// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/repair.hpp"

#include <algorithm>
#include <cmath>

#include "preprocess/weights/harmonic.hpp"

namespace ecorche::weights {
namespace {

constexpr int kRings = 2;

/// Marks the free nodes within `kRings` of a row that left the bounds; empty when there is none.
std::vector<std::uint8_t> patch_nodes(const solve::SparseMatrix& L, const std::vector<std::uint8_t>& fixed,
                                      const Eigen::MatrixXd& values) {
  std::vector<std::uint8_t> inside(fixed.size(), 0);
  bool any = false;
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    const auto row = values.row(static_cast<Eigen::Index>(n));
    inside[n] = !fixed[n] && (row.minCoeff() < -kSmallViolation || row.maxCoeff() > 1 + kSmallViolation);
    any = any || inside[n];
  }
  if (!any) return {};
  for (int ring = 0; ring < kRings; ++ring) {
    const std::vector<std::uint8_t> before = inside;
    for (Eigen::Index c = 0; c < L.outerSize(); ++c) {
      for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
        const auto a = static_cast<std::size_t>(c), b = static_cast<std::size_t>(entry.row());
        if (before[a]) inside[b] = !fixed[b];
        if (before[b]) inside[a] = !fixed[a];
      }
    }
  }
  return inside;
}

void clamp_row(Eigen::MatrixXd& values, Eigen::Index n) {
  values.row(n) = values.row(n).cwiseMax(0).cwiseMin(1);
  values.row(n) /= values.row(n).sum();
}

/// Step 1 on the marked nodes.
void solve_patches(const solve::SparseMatrix& L, const std::vector<std::uint8_t>& inside,
                   Eigen::MatrixXd& values, const Context& context) {
  const Eigen::VectorXd diagonal = L.diagonal();
  std::vector<std::int32_t> local(inside.size(), -1);  // inner nodes, then the nodes around them
  std::vector<std::int32_t> global;
  for (std::size_t n = 0; n < inside.size(); ++n) {
    if (!inside[n]) continue;
    local[n] = static_cast<std::int32_t>(global.size());
    global.push_back(static_cast<std::int32_t>(n));
  }
  const std::size_t inner = global.size();
  std::vector<Eigen::Triplet<double, std::int32_t>> entries;
  const auto local_of = [&](std::size_t n) {
    if (local[n] < 0) {
      local[n] = static_cast<std::int32_t>(global.size());
      global.push_back(static_cast<std::int32_t>(n));
    }
    return local[n];
  };
  for (Eigen::Index c = 0; c < L.outerSize(); ++c) {
    for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
      const auto a = static_cast<std::size_t>(c), b = static_cast<std::size_t>(entry.row());
      if (a == b || (!inside[a] && !inside[b])) continue;
      // The floor keeps every node tied to its neighbours, so that no group of them is left without a value.
      const double floor = 1e-6 * std::min(diagonal(c), diagonal(entry.row()));
      const double tie = std::max(-entry.value(), floor);
      const std::int32_t i = local_of(a), j = local_of(b);
      entries.emplace_back(std::max(i, j), std::min(i, j), -tie);
      entries.emplace_back(i, i, tie);
      entries.emplace_back(j, j, tie);
    }
  }
  const auto size = static_cast<std::int32_t>(global.size());
  solve::SparseMatrix M(size, size);
  M.setFromTriplets(entries.begin(), entries.end());

  std::vector<std::uint8_t> around(global.size(), 1);
  std::fill_n(around.begin(), inner, std::uint8_t{0});
  Eigen::MatrixXd boundary = Eigen::MatrixXd::Zero(size, values.cols());
  for (std::size_t i = inner; i < global.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    boundary.row(row) = values.row(global[i]);
    clamp_row(boundary, row);
  }
  const auto solver = solve::make_eigen_solver();
  Context quiet;
  quiet.stop = context.stop;
  const HarmonicResult mended = solve_harmonic(M, around, boundary, *solver, quiet);
  for (std::size_t i = 0; i < inner; ++i)
    values.row(global[i]) = mended.values.row(static_cast<Eigen::Index>(i));
}

}  // namespace

Repair repair(const solve::SparseMatrix& L, const std::vector<std::uint8_t>& fixed, Eigen::MatrixXd& values,
              const Context& context) {
  Repair report;
  const std::vector<std::uint8_t> inside = patch_nodes(L, fixed, values);
  Eigen::MatrixXd solved;
  if (!inside.empty()) {
    solved = values;
    solve_patches(L, inside, values, context);
  }
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    const auto row = static_cast<Eigen::Index>(n);
    if (fixed[n]) continue;
    const Eigen::RowVectorXd before = solved.size() > 0 ? solved.row(row) : values.row(row);
    const bool left = values.row(row).minCoeff() < -kRounding || values.row(row).maxCoeff() > 1 + kRounding;
    clamp_row(values, row);
    if (!left && (inside.empty() || !inside[n])) continue;
    ++report.rows;
    Eigen::Index column = 0;
    const double change = (values.row(row) - before).cwiseAbs().maxCoeff(&column);
    if (change > report.largest_change) {
      report.largest_change = change;
      report.worst_solved = before(column);
      report.worst_node = static_cast<std::int32_t>(n);
      report.worst_column = static_cast<std::int32_t>(column);
    }
  }
  return report;
}

}  // namespace ecorche::weights
