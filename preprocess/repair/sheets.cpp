// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/geometry/surface_edges.hpp"
#include "preprocess/repair/soup.hpp"

namespace ecorche::repair {
namespace {

using Eigen::Vector3d;
using geometry::HalfEdge;

constexpr int kMiddleRounds = 5;
constexpr double kApart = 1e-3;  // mm between copies: float32 still tells them apart 8 m from the origin

// Around an edge, behind a triangle that runs downward comes the solid, then a triangle that runs upward:
// brackets that open and close, on a circle. Pairs of places in `edge`.
std::vector<std::pair<std::size_t, std::size_t>> wall_pairs(const Soup& soup,
                                                            std::span<const HalfEdge> edge) {
  const auto point = [&](std::int32_t v) -> const Vector3d& {
    return soup.points[static_cast<std::size_t>(v)];
  };
  const Vector3d low = point(edge[0].low);
  const Vector3d along = (point(edge[0].high) - low).normalized();
  const Vector3d x = along.unitOrthogonal(), y = along.cross(x);
  std::vector<std::pair<double, std::size_t>> around;
  for (std::size_t i = 0; i < edge.size(); ++i) {
    const auto& t = soup.triangles[static_cast<std::size_t>(edge[i].triangle)];
    const Vector3d apex = point(t[0]) + point(t[1]) + point(t[2]) - low - point(edge[0].high);
    around.emplace_back(std::atan2((apex - low).dot(y), (apex - low).dot(x)), i);
  }
  std::sort(around.begin(), around.end());
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  std::vector<std::size_t> opened;
  std::set<std::size_t> paired;
  for (std::size_t n = 0; n < 2 * around.size(); ++n) {
    const std::size_t i = around[n % around.size()].second;
    if (paired.contains(i)) continue;
    if (!edge[i].upward) {
      if (n < around.size()) opened.push_back(i);
    } else if (!opened.empty()) {
      pairs.emplace_back(opened.back(), i);
      paired.insert({opened.back(), i});
      opened.pop_back();
    }
  }
  return pairs;
}

class Splitter {
 public:
  explicit Splitter(Soup& soup) : soup_(soup) {
    for (std::size_t corner = 0; corner < 3 * soup.triangles.size(); ++corner) parent_.push_back(corner);
  }

  std::int64_t run() {
    const auto edges = geometry::sorted_edges(soup_.F());
    geometry::each_edge(edges, [&](std::span<const HalfEdge> edge) {
      if (edge.size() == 2 && edge[0].upward != edge[1].upward) glue(edge[0], edge[1]);
      if (edge.size() <= 2) return;
      for (const auto& [a, b] : wall_pairs(soup_, edge)) glue(edge[a], edge[b]);
    });
    return copy_vertices();
  }

 private:
  std::size_t root(std::size_t corner) {
    while (parent_[corner] != corner) corner = parent_[corner] = parent_[parent_[corner]];
    return corner;
  }
  std::size_t corner(const HalfEdge& edge, std::int32_t vertex) const {
    const auto& t = soup_.triangles[static_cast<std::size_t>(edge.triangle)];
    return 3 * static_cast<std::size_t>(edge.triangle) +
           static_cast<std::size_t>(std::find(t.begin(), t.end(), vertex) - t.begin());
  }
  void glue(const HalfEdge& a, const HalfEdge& b) {
    for (const std::int32_t vertex : {a.low, a.high}) {
      const std::size_t i = root(corner(a, vertex)), j = root(corner(b, vertex));
      parent_[std::max(i, j)] = std::min(i, j);
    }
  }

  std::int64_t copy_vertices() {
    std::map<std::pair<std::int32_t, std::size_t>, std::pair<Vector3d, int>> fans;  // sums of their triangles
    std::vector<std::size_t> first(soup_.points.size(), none);
    for (std::size_t c = 0; c < parent_.size(); ++c) {
      std::size_t& f = first[static_cast<std::size_t>(vertex(c))];
      if (f == none) f = root(c);
    }
    for (std::size_t c = 0; c < parent_.size(); ++c) {
      if (root(c) == first[static_cast<std::size_t>(vertex(c))]) continue;
      auto& fan = fans.try_emplace({vertex(c), root(c)}, Vector3d::Zero(), 0).first->second;
      for (const std::int32_t v : soup_.triangles[c / 3])
        fan.first += soup_.points[static_cast<std::size_t>(v)] / 3;
      ++fan.second;
    }
    std::map<std::pair<std::int32_t, std::size_t>, std::int32_t> copies;
    for (const auto& [key, fan] : fans) {
      const Vector3d at = soup_.points[static_cast<std::size_t>(key.first)];
      const Vector3d inward = fan.first / fan.second - at;
      copies[key] = static_cast<std::int32_t>(soup_.points.size());
      const double length = inward.norm();
      soup_.points.push_back(length > 0 ? Vector3d(at + inward * (kApart / length)) : at);
    }
    for (std::size_t c = 0; c < parent_.size(); ++c) {
      const auto copy = copies.find({vertex(c), root(c)});
      if (copy != copies.end()) soup_.triangles[c / 3][c % 3] = copy->second;
    }
    return static_cast<std::int64_t>(copies.size());
  }

  std::int32_t vertex(std::size_t corner) const { return soup_.triangles[corner / 3][corner % 3]; }

  static constexpr std::size_t none = static_cast<std::size_t>(-1);
  Soup& soup_;
  std::vector<std::size_t> parent_;  // of corners 3 f + c: those joined across edges share a vertex
};

// Edges of several sheets whose ends could not be split, since the sheets meet around them: each pair of
// walls gets a middle of its own.
std::int64_t split_middles(Soup& soup) {
  std::int64_t made = 0;
  for (int round = 0; round < kMiddleRounds; ++round) {
    const std::int64_t before = made;
    std::vector<std::uint8_t> touched(soup.triangles.size(), 0);
    const auto edges = geometry::sorted_edges(soup.F());
    geometry::each_edge(edges, [&](std::span<const HalfEdge> edge) {
      if (edge.size() <= 2) return;
      for (const HalfEdge& e : edge) {
        if (touched[static_cast<std::size_t>(e.triangle)] != 0) return;  // another round
      }
      std::vector<std::vector<std::size_t>> groups;
      std::set<std::size_t> paired;
      for (const auto& [a, b] : wall_pairs(soup, edge)) {
        groups.push_back({a, b});
        paired.insert({a, b});
      }
      for (std::size_t i = 0; i < edge.size(); ++i) {
        if (!paired.contains(i)) groups.push_back({i});
      }
      for (const auto& group : groups) {
        const std::int32_t low = edge[0].low, high = edge[0].high;
        const Vector3d middle =
            0.5 * (soup.points[static_cast<std::size_t>(low)] + soup.points[static_cast<std::size_t>(high)]);
        Vector3d inward = Vector3d::Zero();
        const auto m = static_cast<std::int32_t>(soup.points.size());
        for (const std::size_t i : group) {
          const auto f = static_cast<std::size_t>(edge[i].triangle);
          touched[f] = 1;
          auto second = soup.triangles[f];
          for (const std::int32_t v : second) inward += soup.points[static_cast<std::size_t>(v)] - middle;
          std::replace(soup.triangles[f].begin(), soup.triangles[f].end(), low, m);
          std::replace(second.begin(), second.end(), high, m);
          soup.triangles.push_back(second);
        }
        const double length = inward.norm();
        soup.points.push_back(length > 0 ? Vector3d(middle + inward * (kApart / length)) : middle);
        ++made;
      }
    });
    if (made == before) break;
  }
  return made;
}

}  // namespace

std::int64_t split_sheets(Soup& soup) {
  const std::int64_t copies = Splitter(soup).run();
  return copies + split_middles(soup);
}

}  // namespace ecorche::repair
