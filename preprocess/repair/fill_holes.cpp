// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/geometry/surface_edges.hpp"
#include "preprocess/repair/soup.hpp"

namespace ecorche::repair {
namespace {

using Edge = std::pair<std::int32_t, std::int32_t>;

constexpr std::size_t kMostEdges = 800;  // of a loop filled by the least area: the time grows as their cube

Edge edge_of(std::int32_t a, std::int32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

using Corners = std::array<std::int32_t, 3>;

Corners sorted(Corners corners) {
  std::sort(corners.begin(), corners.end());
  return corners;
}

// Cuts corners off a loop, the one with the shortest chord first, until `most` are left; the triangles and
// their area. Of a loop that cannot be cut so far more are left.
class Ears {
 public:
  Ears(const Soup& soup, std::vector<std::int32_t>& loop, std::size_t most, const std::set<Edge>& taken,
       const std::set<Corners>& present)
      : soup_(soup), loop_(loop), before_(loop.size()), after_(loop.size()), cut_(loop.size(), 0) {
    const std::size_t n = loop.size();
    for (std::size_t i = 0; i < n; ++i) {
      before_[i] = (i + n - 1) % n;
      after_[i] = (i + 1) % n;
      chords_.insert({chord(i), i});
    }
    for (std::size_t left = n; left > most && !chords_.empty();) {
      const std::size_t i = chords_.begin()->second;
      chords_.erase(chords_.begin());
      const std::size_t a = before_[i], b = after_[i];
      const Corners ear{loop[a], loop[i], loop[b]};
      if (taken.contains(edge_of(ear[0], ear[2])) || present.contains(sorted(ear))) continue;
      for (const std::size_t beside : {a, b}) chords_.erase({chord(beside), beside});
      after_[a] = b;
      before_[b] = a;
      for (const std::size_t beside : {a, b}) chords_.insert({chord(beside), beside});
      cut_[i] = 1;
      triangles_.push_back(ear);
      area_ += 0.5 * (point(i) - point(a)).cross(point(b) - point(a)).norm();
      --left;
    }
    std::size_t kept = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (cut_[i] == 0) loop[kept++] = loop[i];
    }
    loop.resize(kept);
  }

  double area() const { return area_; }
  const std::vector<Corners>& triangles() const { return triangles_; }

 private:
  const Eigen::Vector3d& point(std::size_t i) const {
    return soup_.points[static_cast<std::size_t>(loop_[i])];
  }
  double chord(std::size_t i) const { return (point(after_[i]) - point(before_[i])).squaredNorm(); }

  const Soup& soup_;
  const std::vector<std::int32_t>& loop_;
  std::vector<std::size_t> before_, after_;
  std::vector<std::uint8_t> cut_;
  std::set<std::pair<double, std::size_t>> chords_;  // of the corners that are left
  std::vector<Corners> triangles_;
  double area_ = 0;
};

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
          const double area = area_[at(i, j)] + area_[at(j, k)] + triangle(i, j, k);
          // The back of a triangle that is there fills nothing.
          if (area < best && !present.contains(sorted({loop[i], loop[j], loop[k]})))
            best = area, apex_[at(i, k)] = j;
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

Filled fill_holes(Soup& soup, double area, const Context& context, const ChosenHole& chosen) {
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
    ++out.left;
    if (!loop.closed || loop.vertices.size() < 3 || !(area > 0)) continue;
    if (chosen && !chosen(loop.vertices)) continue;
    std::vector<std::int32_t> corners = loop.vertices;
    const Ears ears(soup, corners, kMostEdges, taken, present);
    if (corners.size() > kMostEdges || !(ears.area() <= area)) continue;
    const Filling filling(soup, corners, taken, present);
    if (!(ears.area() + filling.area() <= area)) continue;
    --out.left;
    const std::size_t before = soup.triangles.size();
    soup.triangles.insert(soup.triangles.end(), ears.triangles().begin(), ears.triangles().end());
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
