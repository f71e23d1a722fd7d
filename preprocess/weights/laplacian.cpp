// SPDX-License-Identifier: Apache-2.0
// The stiffness matrix of linear elements, straight into compressed columns: every node gathers its own tets,
// so nothing is sorted and the sums have one order whatever the number of threads.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <string>

#include "preprocess/weights/harmonic.hpp"

namespace ecorche::weights {
namespace {

/// Tet and corner, packed: 4 * tet + corner.
struct Incidence {
  std::vector<std::int64_t> offsets;  ///< #nodes + 1
  std::vector<std::int64_t> corners;  ///< ascending within a node

  Incidence(Eigen::Index nodes, const Tets& T)
      : offsets(static_cast<std::size_t>(nodes) + 1, 0), corners(static_cast<std::size_t>(T.size())) {
    const std::int32_t* node = T.data();
    for (std::size_t i = 0; i < corners.size(); ++i) ++offsets[static_cast<std::size_t>(node[i]) + 1];
    for (std::size_t n = 1; n < offsets.size(); ++n) offsets[n] += offsets[n - 1];
    std::vector<std::int64_t> next(offsets.begin(), offsets.end() - 1);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      corners[static_cast<std::size_t>(next[static_cast<std::size_t>(node[i])]++)] =
          static_cast<std::int64_t>(i);
    }
  }
};

/// Place of the entry of corners a != b among a tet's six: 01 02 03 12 13 23.
constexpr std::array<std::array<int, 4>, 4> kEdge{
    {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}}};
using EdgeTerms = std::array<double, 6>;

/// V grad_a . grad_b of one tet: with n_a the inward normal of the face opposite a, twice its area long,
/// grad_a is n_a / 6V, hence n_a . n_b / 36V.
EdgeTerms edge_terms(const Points& V, const Tets& T, Eigen::Index t) {
  const Eigen::Vector3d a = V.row(T(t, 0)), b = V.row(T(t, 1)), c = V.row(T(t, 2)), d = V.row(T(t, 3));
  const Eigen::Vector3d u = b - a, v = c - a, w = d - a;
  const std::array<Eigen::Vector3d, 4> n{-(v.cross(w) + w.cross(u) + u.cross(v)), v.cross(w), w.cross(u),
                                         u.cross(v)};
  const double det = n[1].dot(u);
  if (!(det > 0)) {
    throw Error(ErrorKind::data, "laplacian",
                "tet " + std::to_string(t) + " has the volume " + std::to_string(det / 6) + " mm^3",
                "use another mesher: every tet must have a positive volume");
  }
  const double scale = 1 / (6 * det);
  return {scale * n[0].dot(n[1]), scale * n[0].dot(n[2]), scale * n[0].dot(n[3]),
          scale * n[1].dot(n[2]), scale * n[1].dot(n[3]), scale * n[2].dot(n[3])};
}

struct Neighbour {
  std::int32_t node;
  double value;
};

/// The neighbours of `node`, ascending, with the sums over its tets. `row` is scratch.
void gather(const Tets& T, const Incidence& incidence, const std::vector<EdgeTerms>& terms, std::int32_t node,
            std::vector<Neighbour>& row) {
  row.clear();
  const auto n = static_cast<std::size_t>(node);
  for (std::int64_t i = incidence.offsets[n]; i < incidence.offsets[n + 1]; ++i) {
    const std::int64_t packed = incidence.corners[static_cast<std::size_t>(i)];
    const std::int64_t t = packed / 4;
    const auto corner = static_cast<std::size_t>(packed % 4);
    for (std::size_t other = 0; other < 4; ++other) {
      if (other == corner) continue;
      const std::int32_t b = T(t, static_cast<Eigen::Index>(other));
      const double value = terms[static_cast<std::size_t>(t)][static_cast<std::size_t>(kEdge[corner][other])];
      const auto found =
          std::find_if(row.begin(), row.end(), [b](const Neighbour& x) { return x.node == b; });
      if (found == row.end()) {
        row.push_back({b, value});
      } else {
        found->value += value;
      }
    }
  }
  std::sort(row.begin(), row.end(), [](const Neighbour& x, const Neighbour& y) { return x.node < y.node; });
}

/// Calls `f(node, row)` for every node in parallel.
template <class F>
void for_each_row(const Tets& T, const Incidence& incidence, const std::vector<EdgeTerms>& terms,
                  std::int32_t nodes, const F& f) {
  tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, nodes, 1024), [&](const auto& range) {
    std::vector<Neighbour> row;
    for (std::int32_t n = range.begin(); n < range.end(); ++n) {
      gather(T, incidence, terms, n, row);
      f(n, row);
    }
  });
}

}  // namespace

double positive_offdiagonal_share(const solve::SparseMatrix& L) {
  const Eigen::VectorXd diagonal = L.diagonal();
  std::int64_t positive = 0, all = 0;
  for (Eigen::Index c = 0; c < L.outerSize(); ++c) {
    for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
      if (entry.row() == c) continue;
      ++all;
      // Right angles give an exact zero on paper and either sign in floating point.
      if (entry.value() > 1e-12 * (diagonal(c) + diagonal(entry.row()))) ++positive;
    }
  }
  return all == 0 ? 0.0 : static_cast<double>(positive) / static_cast<double>(all);
}

solve::SparseMatrix laplacian(const Points& V, const Tets& T, double* positive_share) {
  const auto nodes = static_cast<std::int32_t>(V.rows());
  std::vector<EdgeTerms> terms(static_cast<std::size_t>(T.rows()));
  tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, T.rows(), 4096), [&](const auto& range) {
    for (Eigen::Index t = range.begin(); t < range.end(); ++t) {
      terms[static_cast<std::size_t>(t)] = edge_terms(V, T, t);
    }
  });
  const Incidence incidence(V.rows(), T);

  solve::SparseMatrix L(nodes, nodes);
  std::int32_t* offsets = L.outerIndexPtr();
  offsets[0] = 0;
  for_each_row(T, incidence, terms, nodes, [&](std::int32_t n, const std::vector<Neighbour>& row) {
    std::int32_t below = 1;
    for (const Neighbour& x : row) below += x.node > n;
    offsets[n + 1] = below;
  });
  for (std::int32_t n = 0; n < nodes; ++n) offsets[n + 1] += offsets[n];
  L.resizeNonZeros(offsets[nodes]);
  for_each_row(T, incidence, terms, nodes, [&](std::int32_t n, const std::vector<Neighbour>& row) {
    std::int32_t at = offsets[n];
    const std::int32_t diagonal = at++;
    double sum = 0;
    for (const Neighbour& x : row) {
      sum += x.value;
      if (x.node < n) continue;
      L.innerIndexPtr()[at] = x.node;
      L.valuePtr()[at++] = x.value;
    }
    L.innerIndexPtr()[diagonal] = n;
    L.valuePtr()[diagonal] = -sum;  // constants are harmonic
  });
  if (positive_share != nullptr) *positive_share = positive_offdiagonal_share(L);
  return L;
}

}  // namespace ecorche::weights
