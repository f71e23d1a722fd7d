// SPDX-License-Identifier: Apache-2.0
// Laplace's equation with the fixed nodes eliminated: L_ff X_f = -L_fb B, only the free block is factored.
#include "preprocess/weights/harmonic.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/solve/counting_sort.hpp"

namespace ecorche::weights {
namespace {

/// The free block of L (lower triangle) and the right-hand sides -L_fb B, in the order of the free nodes.
struct FreeSystem {
  solve::SparseMatrix A;
  solve::Block rhs;
};

/// Right angles tie nothing: six of the fourteen neighbours of a node of the lattice.
bool vanishes(const solve::SparseMatrix::InnerIterator& entry) {
  return entry.value() == 0 && entry.row() != entry.col();
}

/// Calls f(first, count) for pieces of the rows.
template <class F>
void for_pieces(Eigen::Index rows, F&& f) {
  tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, rows, 4096),
                    [&](const auto& range) { f(range.begin(), range.end() - range.begin()); });
}

/// Of each node of this kind its place among them, -1 of the others.
std::vector<std::int32_t> places(const std::vector<std::uint8_t>& kind, std::uint8_t wanted) {
  std::vector<std::int32_t> out(kind.size(), -1);
  std::int32_t count = 0;
  for (std::size_t n = 0; n < kind.size(); ++n) {
    if (kind[n] == wanted) out[n] = count++;
  }
  return out;
}

/// The fixed nodes' rows.
solve::Block rows_of(const std::vector<std::uint8_t>& fixed, std::int32_t free_count,
                     const solve::Block& all) {
  solve::Block out(all.rows() - free_count, all.cols());
  Eigen::Index row = 0;
  for (Eigen::Index n = 0; n < all.rows(); ++n) {
    if (fixed[static_cast<std::size_t>(n)]) out.row(row++) = all.row(n);
  }
  return out;
}

FreeSystem eliminate(const solve::SparseMatrix& L, const std::vector<std::int32_t>& free_row,
                     std::int32_t free_count, const solve::Block& boundary) {
  FreeSystem system;
  system.A.resize(free_count, free_count);
  system.rhs.resize(free_count, boundary.cols());
  for_pieces(free_count,
             [&](Eigen::Index first, Eigen::Index count) { system.rhs.middleRows(first, count).setZero(); });
  std::int32_t* offsets = system.A.outerIndexPtr();
  const auto row_of = [&](Eigen::Index n) { return free_row[static_cast<std::size_t>(n)]; };

  // Free rows keep the order of the nodes, so the lower triangle stays lower.
  constexpr Eigen::Index kNodes = 8192;
  struct Tie {  // of a free row and a fixed node
    std::int32_t row;
    Eigen::Index node;
    double value;
  };
  std::vector<std::vector<Tie>> ties(static_cast<std::size_t>((L.outerSize() + kNodes - 1) / kNodes));
  const auto for_columns = [&](std::size_t part, auto&& f) {
    const auto first = static_cast<Eigen::Index>(part) * kNodes;
    for (Eigen::Index c = first; c < std::min(first + kNodes, L.outerSize()); ++c) f(c);
  };
  offsets[0] = 0;
  tbb::parallel_for(std::size_t{0}, ties.size(), [&](std::size_t part) {
    for_columns(part, [&](Eigen::Index c) {
      std::int32_t count = 0;
      for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
        if (vanishes(entry)) continue;
        const std::int32_t row = row_of(entry.row()), column = row_of(c);
        if (row >= 0 && column >= 0) ++count;
        if (row >= 0 && column < 0) ties[part].push_back({row, c, entry.value()});
        if (row < 0 && column >= 0) ties[part].push_back({column, entry.row(), entry.value()});
      }
      if (row_of(c) >= 0) offsets[row_of(c) + 1] = count;
    });
  });
  for (std::int32_t n = 0; n < free_count; ++n) offsets[n + 1] += offsets[n];
  system.A.resizeNonZeros(offsets[free_count]);
  tbb::parallel_for(std::size_t{0}, ties.size(), [&](std::size_t part) {
    for_columns(part, [&](Eigen::Index c) {
      if (row_of(c) < 0) return;
      std::int32_t at = offsets[row_of(c)];
      for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
        if (vanishes(entry) || row_of(entry.row()) < 0) continue;
        system.A.innerIndexPtr()[at] = row_of(entry.row());
        system.A.valuePtr()[at++] = entry.value();
      }
    });
  });
  // Each piece of the rows takes its ties in the order of the nodes.
  const auto piece_of = [&](const Tie& tie) { return static_cast<std::size_t>(tie.row / kNodes); };
  const std::size_t pieces = static_cast<std::size_t>((free_count + kNodes - 1) / kNodes);
  solve::CountingSort<std::uint32_t> sort(pieces, ties.size(), [&](std::size_t part, auto&& add) {
    for (const Tie& tie : ties[part]) add(piece_of(tie));
  });
  solve::RawVector<const Tie*> sorted(sort.places());
  sort.fill([&](std::size_t part, auto&& take) {
    for (const Tie& tie : ties[part]) sorted[take(piece_of(tie))] = &tie;
  });
  const auto first = sort.take_offsets();
  tbb::parallel_for(std::size_t{0}, pieces, [&](std::size_t piece) {
    for (std::size_t at = first[piece]; at < first[piece + 1]; ++at)
      system.rhs.row(sorted[at]->row) -= sorted[at]->value * boundary.row(sorted[at]->node);
  });
  return system;
}

}  // namespace

HarmonicResult solve_harmonic(const solve::SparseMatrix& L, const std::vector<std::uint8_t>& fixed,
                              solve::Block boundary, solve::SpdSolver& solver, const Context& context) {
  const std::vector<std::int32_t> free_row = places(fixed, 0);
  const auto free_count = static_cast<std::int32_t>(std::count(fixed.begin(), fixed.end(), 0));
  HarmonicResult result;
  if (free_count == 0) {
    result.values = std::move(boundary);
    return result;
  }
  if (free_count == static_cast<std::int32_t>(fixed.size())) {
    throw Error(ErrorKind::data, "weights", "no node is fixed", "the mesh must touch at least one bone");
  }
  FreeSystem system = eliminate(L, free_row, free_count, boundary);
  const solve::Block kept = rows_of(fixed, free_count, boundary);
  boundary.resize(0, 0);  // all of it again once it is solved: memory is most in between
  context.check_stop();
  solver.factor(system.A, context);
  context.report(0.6);
  const solve::SparseBlock rhs(system.rhs);
  system.rhs.resize(0, 0);
  const solve::Block X = solver.solve(rhs, context);
  context.report(0.9);
  result.residual = solve::relative_residual(system.A, X, rhs.whole());
  result.values.resize(static_cast<Eigen::Index>(fixed.size()), X.cols());
  const std::vector<std::int32_t> fixed_row = places(fixed, 1);
  for_pieces(result.values.rows(), [&](Eigen::Index first, Eigen::Index count) {
    for (Eigen::Index n = first; n < first + count; ++n) {
      const auto at = static_cast<std::size_t>(n);
      result.values.row(n) = fixed[at] ? kept.row(fixed_row[at]) : X.row(free_row[at]);
    }
  });
  return result;
}

}  // namespace ecorche::weights
