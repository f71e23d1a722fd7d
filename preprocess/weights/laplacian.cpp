// SPDX-License-Identifier: Apache-2.0
// The stiffness matrix of linear elements, straight into compressed columns: every node gathers its own tets,
// so nothing is sorted and the sums have one order whatever the number of threads.
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <string>

#include "core/solve/counting_sort.hpp"
#include "preprocess/weights/edge_terms.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::weights {
namespace {

/// Tet and corner, packed: 4 * tet + corner.
struct Incidence {
  solve::RawVector<std::uint32_t> corners;  ///< ascending within a node
  solve::RawVector<std::uint32_t> offsets;  ///< #nodes + 1

  Incidence(Eigen::Index nodes, const Tets& T) : corners(static_cast<std::size_t>(T.size())) {
    const std::int32_t* node = T.data();
    const auto group = [&](std::size_t corner) { return static_cast<std::size_t>(node[corner]); };
    solve::CountingSort<std::uint32_t> sort(static_cast<std::size_t>(nodes), corners.size(),
                                            [&](std::size_t corner, auto&& add) { add(group(corner)); });
    sort.fill([&](std::size_t corner, auto&& take) {
      corners[take(group(corner))] = static_cast<std::uint32_t>(corner);
    });
    offsets = sort.take_offsets();
  }
};

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

/// What one thread gathers rows with: where in the row a node has its place, -1 for none.
struct Gatherer {
  std::vector<std::int32_t> place;
  std::vector<Neighbour> row;

  explicit Gatherer(std::int32_t nodes) : place(static_cast<std::size_t>(nodes), -1) {}

  /// The neighbours of `node`, ascending, with the sums over its tets.
  void gather(const Tets& T, const Incidence& incidence, const solve::RawVector<EdgeTerms>& terms,
              std::int32_t node) {
    row.clear();
    const auto n = static_cast<std::size_t>(node);
    for (std::uint32_t i = incidence.offsets[n]; i < incidence.offsets[n + 1]; ++i) {
      const std::uint32_t packed = incidence.corners[i];
      const auto t = static_cast<Eigen::Index>(packed / 4);
      const auto corner = static_cast<std::size_t>(packed % 4);
      for (std::size_t other = 0; other < 4; ++other) {
        if (other == corner) continue;
        const std::int32_t b = T(t, static_cast<Eigen::Index>(other));
        const double value =
            terms[static_cast<std::size_t>(t)][static_cast<std::size_t>(edge_of[corner][other])];
        std::int32_t& at = place[static_cast<std::size_t>(b)];
        if (at < 0) {
          at = static_cast<std::int32_t>(row.size());
          row.push_back({b, value});
        } else {
          row[static_cast<std::size_t>(at)].value += value;
        }
      }
    }
    for (const Neighbour& x : row) place[static_cast<std::size_t>(x.node)] = -1;
    std::sort(row.begin(), row.end(), [](const Neighbour& x, const Neighbour& y) { return x.node < y.node; });
  }
};

/// Columns of L that one piece of work made.
struct Piece {
  std::vector<std::int32_t> row;
  std::vector<double> value;
};

}  // namespace

double positive_offdiagonal_share(const solve::SparseMatrix& L) {
  // A column of the lower triangle starts with its diagonal.
  const auto own = [&](Eigen::Index n) { return L.valuePtr()[L.outerIndexPtr()[n]]; };
  struct Count {
    std::int64_t positive = 0, all = 0;
  };
  const auto [positive, all] = tbb::parallel_reduce(
      tbb::blocked_range<Eigen::Index>(0, L.outerSize(), 16384), Count{},
      [&](const auto& range, Count count) {
        for (Eigen::Index c = range.begin(); c < range.end(); ++c) {
          for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
            if (entry.row() == c) continue;
            ++count.all;
            // Right angles give an exact zero on paper and either sign in floating point.
            if (entry.value() > 1e-12 * (own(c) + own(entry.row()))) ++count.positive;
          }
        }
        return count;
      },
      [](const Count& a, const Count& b) {
        return Count{a.positive + b.positive, a.all + b.all};
      });
  return all == 0 ? 0.0 : static_cast<double>(positive) / static_cast<double>(all);
}

solve::SparseMatrix assemble(Eigen::Index count, const Tets& T, const solve::RawVector<EdgeTerms>& terms) {
  const auto nodes = static_cast<std::int32_t>(count);
  const Incidence incidence(count, T);

  solve::SparseMatrix L(nodes, nodes);
  std::int32_t* offsets = L.outerIndexPtr();
  offsets[0] = 0;
  constexpr std::int32_t kNodes = 4096;
  std::vector<Piece> pieces(static_cast<std::size_t>((nodes + kNodes - 1) / kNodes));
  tbb::enumerable_thread_specific<Gatherer> gatherers([&] { return Gatherer(nodes); });
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t p) {
    Gatherer& gatherer = gatherers.local();
    Piece& piece = pieces[p];
    const std::int32_t first = static_cast<std::int32_t>(p) * kNodes;
    for (std::int32_t n = first; n < std::min(first + kNodes, nodes); ++n) {
      gatherer.gather(T, incidence, terms, n);
      const std::size_t diagonal = piece.row.size();
      piece.row.push_back(n);
      piece.value.push_back(0);
      double sum = 0;
      for (const Neighbour& x : gatherer.row) {
        sum += x.value;
        if (x.node < n) continue;
        piece.row.push_back(x.node);
        piece.value.push_back(x.value);
      }
      piece.value[diagonal] = -sum;  // constants are harmonic
      offsets[n + 1] = static_cast<std::int32_t>(piece.row.size() - diagonal);
    }
  });
  for (std::int32_t n = 0; n < nodes; ++n) offsets[n + 1] += offsets[n];
  L.resizeNonZeros(offsets[nodes]);
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t p) {
    Piece& piece = pieces[p];
    const std::int32_t at = offsets[static_cast<std::int32_t>(p) * kNodes];
    std::copy(piece.row.begin(), piece.row.end(), L.innerIndexPtr() + at);
    std::copy(piece.value.begin(), piece.value.end(), L.valuePtr() + at);
    piece = {};
  });
  return L;
}

solve::SparseMatrix laplacian(const Points& V, const Tets& T, double* positive_share) {
  return laplacian(V, T, {}, positive_share);
}

solve::SparseMatrix laplacian(const Points& V, const Tets& T, const std::vector<double>& conductivity,
                              double* positive_share) {
  solve::RawVector<EdgeTerms> terms(static_cast<std::size_t>(T.rows()));
  tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, T.rows(), 4096), [&](const auto& range) {
    for (Eigen::Index t = range.begin(); t < range.end(); ++t) {
      EdgeTerms& own = terms[static_cast<std::size_t>(t)];
      own = edge_terms(V, T, t);
      if (conductivity.empty()) continue;
      for (double& term : own) term *= conductivity[static_cast<std::size_t>(t)];
    }
  });
  solve::SparseMatrix L = assemble(V.rows(), T, terms);
  if (positive_share != nullptr) *positive_share = positive_offdiagonal_share(L);
  return L;
}

}  // namespace ecorche::weights
