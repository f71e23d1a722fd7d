// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "preprocess/geometry/surface_edges.hpp"
#include "preprocess/repair/soup.hpp"

namespace ecorche::repair {
namespace {

using Edge = std::pair<std::int32_t, std::int32_t>;

constexpr std::size_t kMostEdges = 800;  // of a hole: the time grows as their cube

Edge edge_of(std::int32_t a, std::int32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

using Corners = std::array<std::int32_t, 3>;

Corners sorted(Corners corners) {
  std::sort(corners.begin(), corners.end());
  return corners;
}

// The triangulation of a loop of least area, by dynamic programming over its chords.
class Filling {
 public:
  Filling(const Soup& soup, const std::vector<std::int32_t>& loop, const std::set<Edge>& taken,
          const std::set<Corners>& present)
      : soup_(soup), loop_(loop), count_(loop.size()), area_(count_ * count_, 0), apex_(count_ * count_, 0) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    for (std::size_t span = 2; span < count_; ++span) {
      for (std::size_t i = 0; i + span < count_; ++i) {
        const std::size_t k = i + span;
        double& best = area_[at(i, k)];
        best = infinity;
        // A chord that is an edge elsewhere would have more than two triangles.
        const bool rim = i == 0 && k == count_ - 1;
        if (!rim && taken.contains(edge_of(loop[i], loop[k]))) continue;
        for (std::size_t j = i + 1; j < k; ++j) {
          // The back of a triangle that is there fills nothing.
          if (present.contains(sorted({loop[i], loop[j], loop[k]}))) continue;
          const double area = area_[at(i, j)] + area_[at(j, k)] + triangle(i, j, k);
          if (area < best) best = area, apex_[at(i, k)] = j;
        }
      }
    }
  }

  double area() const { return area_[at(0, count_ - 1)]; }

  void append(std::vector<std::array<std::int32_t, 3>>& out) const { append(out, 0, count_ - 1); }

 private:
  std::size_t at(std::size_t i, std::size_t k) const { return i * count_ + k; }
  double triangle(std::size_t i, std::size_t j, std::size_t k) const {
    const auto p = [&](std::size_t n) -> const Eigen::Vector3d& {
      return soup_.points[static_cast<std::size_t>(loop_[n])];
    };
    return 0.5 * (p(j) - p(i)).cross(p(k) - p(i)).norm();
  }
  void append(std::vector<std::array<std::int32_t, 3>>& out, std::size_t i, std::size_t k) const {
    if (k < i + 2) return;
    const std::size_t j = apex_[at(i, k)];
    out.push_back({loop_[i], loop_[j], loop_[k]});
    append(out, i, j);
    append(out, j, k);
  }

  const Soup& soup_;
  const std::vector<std::int32_t>& loop_;
  std::size_t count_;
  std::vector<double> area_;
  std::vector<std::size_t> apex_;
};

}  // namespace

Filled fill_holes(Soup& soup, double area, const Context& context) {
  const auto edges = geometry::sorted_edges(soup.F());
  const auto loops = geometry::boundary_loops(edges);
  Filled out;
  if (loops.empty()) return out;
  std::set<std::int32_t> rim;
  for (const auto& loop : loops) rim.insert(loop.vertices.begin(), loop.vertices.end());
  std::set<Edge> taken;  // edges between vertices of rims
  for (const geometry::HalfEdge& e : edges) {
    if (rim.contains(e.low) && rim.contains(e.high)) taken.insert({e.low, e.high});
  }
  std::set<Corners> present;  // triangles of such vertices
  for (const Corners& t : soup.triangles) {
    if (rim.contains(t[0]) && rim.contains(t[1]) && rim.contains(t[2])) present.insert(sorted(t));
  }
  for (const auto& loop : loops) {
    context.check_stop();
    const bool possible = loop.closed && loop.vertices.size() >= 3 && loop.vertices.size() <= kMostEdges;
    if (!possible || !(area > 0)) {
      ++out.left;
      continue;
    }
    const Filling filling(soup, loop.vertices, taken, present);
    if (!(filling.area() <= area)) {
      ++out.left;
      continue;
    }
    const std::size_t before = soup.triangles.size();
    filling.append(soup.triangles);
    for (std::size_t f = before; f < soup.triangles.size(); ++f) {
      const Corners& t = soup.triangles[f];
      present.insert(sorted(t));
      for (std::size_t c = 0; c < 3; ++c) taken.insert(edge_of(t[c], t[(c + 1) % 3]));
    }
    ++out.holes;
    out.triangles += static_cast<std::int64_t>(soup.triangles.size() - before);
  }
  return out;
}

}  // namespace ecorche::repair
