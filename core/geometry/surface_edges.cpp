// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/surface_edges.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <tuple>

namespace ecorche::geometry {
namespace {

// Sets that grow together; the lowest member names a set.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::int32_t root(std::int32_t v) {
    while (at(v) != v) v = at(v) = at(at(v));
    return v;
  }
  void join(std::int32_t a, std::int32_t b) {
    a = root(a), b = root(b);
    at(std::max(a, b)) = std::min(a, b);
  }

 private:
  std::int32_t& at(std::int32_t v) { return parent_[static_cast<std::size_t>(v)]; }
  std::vector<std::int32_t> parent_;
};

// Cuts the loops off a walk as soon as it meets itself.
class Walker {
 public:
  explicit Walker(std::span<const HalfEdge> open) : open_(open), used_(open.size(), false) {
    for (std::size_t e = 0; e < open.size(); ++e) {
      at_[open[e].low].push_back(e);
      at_[open[e].high].push_back(e);
    }
  }

  std::vector<BoundaryLoop> all() {
    for (std::size_t e = 0; e < open_.size(); ++e) {
      if (!used_[e]) walk(e);
    }
    return std::move(loops_);
  }

 private:
  void walk(std::size_t first) {
    // Against the triangle.
    std::vector<std::int32_t> path{open_[first].upward ? open_[first].high : open_[first].low};
    std::vector<std::size_t> edges;
    std::map<std::int32_t, std::size_t> place{{path[0], 0}};
    for (std::size_t edge = first; edge != none; edge = next(path.back())) {
      used_[edge] = true;
      const std::int32_t to = open_[edge].low == path.back() ? open_[edge].high : open_[edge].low;
      edges.push_back(edge);
      const auto met = place.find(to);
      if (met == place.end()) {
        place[to] = path.size();
        path.push_back(to);
        continue;
      }
      const std::size_t from = met->second;
      add({path.begin() + static_cast<std::ptrdiff_t>(from), path.end()}, edges[from], true);
      for (std::size_t i = from + 1; i < path.size(); ++i) place.erase(path[i]);
      path.resize(from + 1);
      edges.resize(from);
    }
    if (path.size() > 1) add(path, edges[0], false);
  }

  void add(std::vector<std::int32_t> vertices, std::size_t edge, bool closed) {
    const HalfEdge& e = open_[edge];
    const std::int32_t start = e.upward ? e.high : e.low;
    if (vertices[0] != start) {  // the walk came along this edge the other way
      std::reverse(vertices.begin(), vertices.end());
      if (closed) std::rotate(vertices.begin(), vertices.end() - 2, vertices.end());
    }
    loops_.push_back({std::move(vertices), closed});
  }

  std::size_t next(std::int32_t vertex) const {
    for (const std::size_t e : at_.at(vertex)) {
      if (!used_[e]) return e;
    }
    return none;
  }

  static constexpr std::size_t none = static_cast<std::size_t>(-1);
  std::span<const HalfEdge> open_;
  std::vector<bool> used_;
  std::map<std::int32_t, std::vector<std::size_t>> at_;  // edges of a vertex
  std::vector<BoundaryLoop> loops_;
};

}  // namespace

std::vector<HalfEdge> sorted_edges(const Triangles& F) {
  const auto each = [&](auto&& visit) {
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
      const auto corner = [&](int c) { return F(f, c % 3); };
      if (corner(0) == corner(1) || corner(1) == corner(2) || corner(2) == corner(0)) continue;
      for (int c = 0; c < 3; ++c) {
        const auto [low, high] = std::minmax({corner(c), corner(c + 1)});
        visit(HalfEdge{low, high, static_cast<std::int32_t>(f), corner(c) == low});
      }
    }
  };
  // Counted by the lower vertex; of each there are few.
  const std::size_t vertices = F.rows() == 0 ? 0 : static_cast<std::size_t>(F.maxCoeff()) + 1;
  std::vector<std::size_t> past(vertices + 1, 0);
  each([&](const HalfEdge& edge) { ++past[static_cast<std::size_t>(edge.low) + 1]; });
  std::partial_sum(past.begin(), past.end(), past.begin());
  std::vector<HalfEdge> edges(past.back());
  each([&](const HalfEdge& edge) { edges[past[static_cast<std::size_t>(edge.low)]++] = edge; });
  std::size_t begin = 0;
  for (std::size_t v = 0; v < vertices; ++v) {
    std::sort(edges.begin() + static_cast<std::ptrdiff_t>(begin),
              edges.begin() + static_cast<std::ptrdiff_t>(past[v]), [](const HalfEdge& a, const HalfEdge& b) {
                return std::tie(a.high, a.triangle) < std::tie(b.high, b.triangle);
              });
    begin = past[v];
  }
  return edges;
}

std::vector<BoundaryLoop> boundary_loops(std::span<const HalfEdge> sorted) {
  std::vector<HalfEdge> open;
  each_edge(sorted, [&](std::span<const HalfEdge> edge) {
    if (edge.size() == 1) open.push_back(edge[0]);
  });
  return Walker(open).all();
}

TriangleClasses parts(const SurfaceMesh& mesh) {
  Sets sets(static_cast<std::size_t>(mesh.V.rows()));
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    sets.join(mesh.F(f, 0), mesh.F(f, 1));
    sets.join(mesh.F(f, 0), mesh.F(f, 2));
  }
  std::vector<std::int32_t> number(static_cast<std::size_t>(mesh.V.rows()), -1);
  TriangleClasses out;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    std::int32_t& n = number[static_cast<std::size_t>(sets.root(mesh.F(f, 0)))];
    if (n < 0) n = out.count++;
    out.of.push_back(n);
  }
  return out;
}

Orientation orientation(const Triangles& F, std::span<const HalfEdge> sorted) {
  struct Neighbour {
    std::int32_t triangle = -1;
    bool same = true;  // already runs the same way round
  };
  const auto count = static_cast<std::size_t>(F.rows());
  std::vector<std::array<Neighbour, 3>> neighbours(count);
  std::vector<int> degree(count, 0);
  each_edge(sorted, [&](std::span<const HalfEdge> edge) {
    if (edge.size() != 2) return;
    const bool same = edge[0].upward != edge[1].upward;
    for (const int k : {0, 1}) {
      const auto a = static_cast<std::size_t>(edge[static_cast<std::size_t>(k)].triangle);
      neighbours[a][static_cast<std::size_t>(degree[a]++)] = {edge[static_cast<std::size_t>(1 - k)].triangle,
                                                              same};
    }
  });
  Orientation out;
  out.patches.of.assign(count, -1);
  out.turn.assign(count, false);
  std::vector<std::int32_t> patch;
  for (std::size_t seed = 0; seed < count; ++seed) {
    if (out.patches.of[seed] >= 0) continue;
    patch.assign(1, static_cast<std::int32_t>(seed));
    out.patches.of[seed] = out.patches.count;
    std::size_t turned = 0;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      const auto f = static_cast<std::size_t>(patch[i]);
      turned += out.turn[f];
      for (int k = 0; k < degree[f]; ++k) {
        const Neighbour& n = neighbours[f][static_cast<std::size_t>(k)];
        const auto g = static_cast<std::size_t>(n.triangle);
        if (out.patches.of[g] >= 0) continue;
        out.patches.of[g] = out.patches.count;
        out.turn[g] = out.turn[f] == n.same;
        patch.push_back(n.triangle);
      }
    }
    if (2 * turned > patch.size()) {
      for (const std::int32_t f : patch) out.turn[static_cast<std::size_t>(f)].flip();
    }
    ++out.patches.count;
  }
  return out;
}

}  // namespace ecorche::geometry
