// SPDX-License-Identifier: Apache-2.0
#include "preprocess/label_surfaces/net_cells.hpp"

#include <algorithm>

namespace ecorche::label_surfaces {
namespace {

// The corners of a face in a ring.
constexpr std::array<std::array<int, 4>, 6> kRings{
    {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}}};

CellLoops loops_of(unsigned inside) {
  const auto in = [&](int corner) { return (inside >> corner & 1U) != 0; };
  std::array<int, 12> root{};
  for (std::size_t e = 0; e < 12; ++e) root[e] = static_cast<int>(e);
  const auto join = [&](int a, int b) {
    const int from = root[static_cast<std::size_t>(a)], to = root[static_cast<std::size_t>(b)];
    std::replace(root.begin(), root.end(), from, to);
  };
  const auto diagonal = [&](const std::array<int, 4>& ring) {
    return in(ring[0]) == in(ring[2]) && in(ring[1]) == in(ring[3]) && in(ring[0]) != in(ring[1]);
  };
  for (const auto& ring : kRings) {
    int first = -1;
    for (std::size_t i = 0; i < 4; ++i) {
      const int before = ring[(i + 3) % 4], at = ring[i], after = ring[(i + 1) % 4];
      if (diagonal(ring)) {
        if (!in(at)) join(edge_between(before, at), edge_between(at, after));
      } else if (in(at) != in(after)) {
        const int edge = edge_between(at, after);
        if (first >= 0) join(edge, first);
        first = edge;
      }
    }
  }
  CellLoops loops;
  std::array<int, 12> number{};
  number.fill(-1);
  loops.of_edge.fill(-1);
  for (std::size_t e = 0; e < 12; ++e) {
    if (in(kEdgeCorners[e][0]) == in(kEdgeCorners[e][1])) continue;
    int& n = number[static_cast<std::size_t>(root[e])];
    if (n < 0) n = loops.count++;
    loops.of_edge[e] = static_cast<std::int8_t>(n);
    loops.edges[static_cast<std::size_t>(n)] =
        static_cast<std::uint16_t>(loops.edges[static_cast<std::size_t>(n)] | 1U << e);
  }
  for (std::size_t f = 0; f < 6; ++f) {
    const auto& ring = kRings[f];
    if (!diagonal(ring)) continue;
    const auto edge = [&](std::size_t i) {
      return static_cast<std::size_t>(edge_between(ring[i], ring[(i + 1) % 4]));
    };
    if (loops.of_edge[edge(0)] == loops.of_edge[edge(2)] && loops.of_edge[edge(0)] == loops.of_edge[edge(1)])
      loops.pinched = static_cast<std::uint8_t>(loops.pinched | 1U << f);
  }
  return loops;
}

}  // namespace

int edge_between(int a, int b) {
  const int axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  const int low = std::min(a, b);
  const int u = axis == 0 ? low >> 1 & 1 : low & 1, v = axis == 2 ? low >> 1 & 1 : low >> 2 & 1;
  return 4 * axis + u + 2 * v;
}

const std::array<CellLoops, 256>& cell_loops() {
  static const std::array<CellLoops, 256> table = [] {
    std::array<CellLoops, 256> t;
    for (unsigned i = 0; i < 256; ++i) t[i] = loops_of(i);
    return t;
  }();
  return table;
}

}  // namespace ecorche::label_surfaces
