// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/grade.hpp"

#include <algorithm>
#include <bit>

namespace ecorche::tet {
namespace {

constexpr int kEdges[6][2] = {{0, 1}, {2, 3}, {0, 2}, {0, 3}, {1, 2}, {1, 3}};  // long ones first
using Set = unsigned;                                                           // one bit an edge

/// The face whose three edges are exactly these; -1 where there is none. Named by the corner opposite to it.
int face_of(Set edges) {
  if (std::popcount(edges) != 3) return -1;
  unsigned corners = 0;
  for (int e = 0; e < 6; ++e)
    if ((edges >> e & 1U) != 0) corners |= 1U << kEdges[e][0] | 1U << kEdges[e][1];
  return std::popcount(corners) == 3 ? std::countr_zero(~corners) : -1;
}

struct Large {
  LatticeTet corner;
  std::array<std::int64_t, 6> middle;  // of kEdges
  bool split;                          // into its eight pieces
};

class Grader {
 public:
  explicit Grader(const BccLattice& lattice)
      : lattice_(lattice), shared_(static_cast<std::size_t>(lattice.node_count()), 0) {}

  Graded run(const Quiet& quiet) {
    collect(quiet);
    close();
    Graded out;
    for (const Large& large : all_) {
      if (large.split)
        pieces(large, out.fine);
      else
        green(large, out.large);
    }
    return out;
  }

 private:
  void collect(const Quiet& quiet) {
    const BccLattice::Cell& n = lattice_.cubes();
    const BccLattice twice(lattice_.position(0), 2 * lattice_.side(), {n[0] / 2, n[1] / 2, n[2] / 2});
    for (std::int64_t slot = 0; slot < twice.slot_count(); ++slot) {
      const BccLattice::Cell cell = twice.cell(slot / BccLattice::slots_per_cube);
      if (cell[static_cast<std::size_t>(slot % BccLattice::slots_per_cube / 4)] == 0) continue;
      const auto nodes = twice.nodes(slot);
      std::array<BccLattice::Cell, 4> at;  // halves of the finer side
      Large large{};
      for (std::size_t c = 0; c < 4; ++c) {
        at[c] = twice.node_cell(nodes[c]);
        for (std::int32_t& x : at[c]) x = 4 * x + (twice.is_centre(nodes[c]) ? 2 : 0);
        large.corner[c] = lattice_.node_at(at[c]);
      }
      for (std::size_t e = 0; e < 6; ++e) {
        BccLattice::Cell middle;
        for (std::size_t axis = 0; axis < 3; ++axis)
          middle[axis] = (at[static_cast<std::size_t>(kEdges[e][0])][axis] +
                          at[static_cast<std::size_t>(kEdges[e][1])][axis]) /
                         2;
        large.middle[e] = lattice_.node_at(middle);
      }
      const auto joins = [&](std::int64_t node) {
        return quiet.quiet(node) && quiet.material(node) == quiet.material(large.corner[0]);
      };
      large.split = !std::all_of(large.corner.begin(), large.corner.end(), joins) ||
                    !std::all_of(large.middle.begin(), large.middle.end(), joins);
      all_.push_back(large);
      if (large.split) share(large);
    }
  }

  void share(const Large& large) {
    for (const std::int64_t middle : large.middle) shared_[static_cast<std::size_t>(middle)] = 1;
  }

  Set edges_of(const Large& large) const {
    Set set = 0;
    for (std::size_t e = 0; e < 6; ++e)
      set |= static_cast<Set>(shared_[static_cast<std::size_t>(large.middle[e])]) << e;
    return set;
  }

  /// Until no large tet has more split edges than it can take.
  void close() {
    for (bool changed = true; changed;) {
      changed = false;
      for (Large& large : all_) {
        if (large.split) continue;
        const Set edges = edges_of(large);
        if (std::popcount(edges) < 3 || face_of(edges) >= 0) continue;
        large.split = changed = true;
        share(large);
      }
    }
  }

  static void pieces(const Large& large, std::vector<LatticeTet>& out) {
    const auto& m = large.middle;
    const auto mid = [&](int a, int b) {
      std::size_t e = 0;
      while (!((kEdges[e][0] == a && kEdges[e][1] == b) || (kEdges[e][0] == b && kEdges[e][1] == a))) ++e;
      return m[e];
    };
    for (int c = 0; c < 4; ++c)
      out.push_back({large.corner[static_cast<std::size_t>(c)], mid(c, (c + 1) % 4), mid(c, (c + 2) % 4),
                     mid(c, (c + 3) % 4)});
    const std::int64_t ring[4] = {m[2], m[3], m[5],
                                  m[4]};  // 02, 03, 13, 12: about the middles of the long edges
    for (int r = 0; r < 4; ++r) out.push_back({m[0], m[1], ring[r], ring[(r + 1) % 4]});
  }

  void green(const Large& large, std::vector<LatticeTet>& out) const {
    const Set edges = edges_of(large);
    if (const int apex = face_of(edges); apex >= 0) {
      const std::size_t a = static_cast<std::size_t>(apex), f[3] = {(a + 1) % 4, (a + 2) % 4, (a + 3) % 4};
      std::int64_t m[3];  // opposite f[n]
      for (std::size_t n = 0; n < 3; ++n)
        for (std::size_t e = 0; e < 6; ++e) {
          const auto x = static_cast<std::size_t>(kEdges[e][0]), y = static_cast<std::size_t>(kEdges[e][1]);
          if (x != a && y != a && x != f[n] && y != f[n]) m[n] = large.middle[e];
        }
      for (std::size_t n = 0; n < 3; ++n)
        out.push_back({large.corner[a], large.corner[f[n]], m[(n + 1) % 3], m[(n + 2) % 3]});
      out.push_back({large.corner[a], m[0], m[1], m[2]});
      return;
    }
    halve(large, large.corner, edges, out);
  }

  /// Halves what holds the first of the split edges, long ones first, of alike ones that with the lower
  /// middle: an order for all tets, so that those at a face agree.
  void halve(const Large& large, const LatticeTet& tet, Set edges, std::vector<LatticeTet>& out) const {
    int best = -1;
    std::size_t from = 0, to = 0;
    for (int e = 0; e < 6; ++e) {
      if ((edges >> e & 1U) == 0) continue;
      const auto place = [&](int c) {
        return static_cast<std::size_t>(
            std::find(tet.begin(), tet.end(), large.corner[static_cast<std::size_t>(c)]) - tet.begin());
      };
      const std::size_t x = place(kEdges[e][0]), y = place(kEdges[e][1]);
      if (x == 4 || y == 4) continue;
      const bool better =
          best < 0 || (e < 2) != (best < 2)
              ? best < 0 || e < 2
              : large.middle[static_cast<std::size_t>(e)] < large.middle[static_cast<std::size_t>(best)];
      if (!better) continue;
      best = e;
      from = x;
      to = y;
    }
    if (best < 0) {
      out.push_back(tet);
      return;
    }
    for (const std::size_t end : {from, to}) {
      LatticeTet half = tet;
      half[end] = large.middle[static_cast<std::size_t>(best)];
      halve(large, half, edges & ~(1U << best), out);
    }
  }

  const BccLattice& lattice_;
  std::vector<std::uint8_t> shared_;  // per node: the middle of an edge of a split one
  std::vector<Large> all_;
};

}  // namespace

Graded grade(const BccLattice& lattice, const Quiet& quiet) {
  return Grader(lattice).run(quiet);
}

}  // namespace ecorche::tet
