// SPDX-License-Identifier: Apache-2.0
#include "preprocess/repair/repair_surface.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "core/geometry/surface_edges.hpp"
#include "preprocess/check/surface_parts.hpp"
#include "preprocess/repair/soup.hpp"

namespace ecorche::repair {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<std::int32_t, 3>;
using geometry::HalfEdge;

constexpr double kFlat = 1e-4;  // mm of height: less is no triangle
constexpr int kSwapRounds = 5;

// What a file holds, and equal points as one.
Soup as_files_hold_it(const SurfaceMesh& surface) {
  Soup soup;
  std::map<std::array<float, 3>, std::int32_t> known;
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
    Triangle& triangle = soup.triangles.emplace_back();
    for (int c = 0; c < 3; ++c) {
      const Eigen::RowVector3f p = surface.V.row(surface.F(f, c)).cast<float>();
      const auto [at, fresh] = known.try_emplace({p.x() + 0.0F, p.y() + 0.0F, p.z() + 0.0F},
                                                 static_cast<std::int32_t>(soup.points.size()));
      if (fresh) soup.points.emplace_back(p.cast<double>().transpose());
      triangle[static_cast<std::size_t>(c)] = at->second;
    }
  }
  return soup;
}

template <class Drop>
std::int64_t drop_if(Soup& soup, Drop&& drop) {
  std::size_t kept = 0;
  for (std::size_t f = 0; f < soup.triangles.size(); ++f) {
    if (!drop(f)) soup.triangles[kept++] = soup.triangles[f];
  }
  const auto dropped = static_cast<std::int64_t>(soup.triangles.size() - kept);
  soup.triangles.resize(kept);
  return dropped;
}

void drop_bad(Soup& soup, Done& done) {
  done.degenerate += drop_if(soup, [&](std::size_t f) {
    const Triangle& t = soup.triangles[f];
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
  });
  std::set<Triangle> known;
  done.duplicates += drop_if(soup, [&](std::size_t f) {
    Triangle sorted = soup.triangles[f];
    std::sort(sorted.begin(), sorted.end());
    return !known.insert(sorted).second;
  });
}

std::int64_t drop_fins(Soup& soup) {
  std::int64_t all = 0;
  for (std::int64_t dropped = 1; dropped > 0; all += dropped) {
    std::vector<std::uint8_t> seen(soup.triangles.size(), 0);
    const auto edges = geometry::sorted_edges(soup.F());
    geometry::each_edge(edges, [&](std::span<const HalfEdge> edge) {
      for (const HalfEdge& e : edge) {
        if (edge.size() != 2) seen[static_cast<std::size_t>(e.triangle)] |= edge.size() == 1 ? 1 : 2;
      }
    });
    dropped = drop_if(soup, [&](std::size_t f) { return seen[f] == 3; });
  }
  return all;
}

// Triangles that share no edge with any other, unless there is nothing else.
std::int64_t drop_lone(Soup& soup) {
  std::vector<std::uint8_t> joined(soup.triangles.size(), 0);
  const auto edges = geometry::sorted_edges(soup.F());
  geometry::each_edge(edges, [&](std::span<const HalfEdge> edge) {
    for (const HalfEdge& e : edge) {
      if (edge.size() > 1) joined[static_cast<std::size_t>(e.triangle)] = 1;
    }
  });
  if (std::find(joined.begin(), joined.end(), 1) == joined.end()) return 0;
  return drop_if(soup, [&](std::size_t f) { return joined[f] == 0; });
}

std::int64_t orient(Soup& soup) {
  const Triangles F = soup.F();
  const geometry::Orientation orientation = geometry::orientation(F, geometry::sorted_edges(F));
  std::int64_t turned = 0;
  for (std::size_t f = 0; f < soup.triangles.size(); ++f) {
    if (!orientation.turn[f]) continue;
    std::swap(soup.triangles[f][1], soup.triangles[f][2]);
    ++turned;
  }
  return turned;
}

double height(const Soup& soup, const Triangle& t) {
  const auto p = [&](std::size_t c) -> const Vector3d& {
    return soup.points[static_cast<std::size_t>(t[c % 3])];
  };
  double longest = 0;
  for (std::size_t c = 0; c < 3; ++c) longest = std::max(longest, (p(c + 1) - p(c)).norm());
  return longest > 0 ? (p(1) - p(0)).cross(p(2) - p(0)).norm() / longest : 0;
}

// A flat triangle gives its longest edge to the neighbour there: two triangles along the other diagonal.
std::int64_t swap_flat(Soup& soup) {
  std::int64_t swapped = 0;
  for (int round = 0; round < kSwapRounds; ++round) {
    const std::vector<HalfEdge> edges = geometry::sorted_edges(soup.F());
    std::set<std::pair<std::int32_t, std::int32_t>> all;
    bool any = false;
    for (const Triangle& t : soup.triangles) any = any || height(soup, t) < kFlat;
    if (!any) break;
    for (const HalfEdge& e : edges) all.insert({e.low, e.high});
    std::vector<bool> touched(soup.triangles.size(), false);
    const std::int64_t before = swapped;
    geometry::each_edge(edges, [&](std::span<const HalfEdge> edge) {
      if (edge.size() != 2 || edge[0].upward == edge[1].upward) return;
      const auto f = static_cast<std::size_t>(edge[0].triangle),
                 g = static_cast<std::size_t>(edge[1].triangle);
      if (touched[f] || touched[g]) return;
      Triangle &s = soup.triangles[f], &t = soup.triangles[g];
      const double least = std::min(height(soup, s), height(soup, t));
      if (!(least < kFlat)) return;
      const auto apex = [&](const Triangle& x) {
        return *std::find_if(x.begin(), x.end(),
                             [&](std::int32_t v) { return v != edge[0].low && v != edge[0].high; });
      };
      const std::int32_t c = apex(s), d = apex(t);
      if (c == d || all.contains({std::min(c, d), std::max(c, d)})) return;
      const std::int32_t a = edge[0].upward ? edge[0].low : edge[0].high;  // s runs a, b, c
      const std::int32_t b = edge[0].upward ? edge[0].high : edge[0].low;
      const Triangle first{a, d, c}, second{d, b, c};
      if (!(std::min(height(soup, first), height(soup, second)) > 2 * least + 1e-9)) return;
      s = first, t = second;
      touched[f] = touched[g] = true;
      all.insert({std::min(c, d), std::max(c, d)});
      ++swapped;
    });
    if (swapped == before) break;
  }
  return swapped;
}

template <class Which>
std::int64_t drop_parts(Soup& soup, Which&& which) {
  const check::SurfaceParts parts = check::surface_parts(soup.mesh());
  std::vector<bool> drop(parts.parts.size());
  std::int64_t count = 0;
  for (std::size_t p = 0; p < drop.size(); ++p) {
    drop[p] = which(parts, static_cast<std::int32_t>(p));
    count += drop[p];
  }
  if (count > 0)
    drop_if(soup, [&](std::size_t f) { return drop[static_cast<std::size_t>(parts.classes.of[f])]; });
  return count;
}

// Outermost parts look outward; what is inside another part turns with it, so that cavities stay cavities.
std::int64_t turn_outward(Soup& soup) {
  const check::SurfaceParts parts = check::surface_parts(soup.mesh());
  const auto inward = [&](std::int32_t p) {
    while (parts.parts[static_cast<std::size_t>(p)].inside >= 0)
      p = parts.parts[static_cast<std::size_t>(p)].inside;
    const check::Part& part = parts.parts[static_cast<std::size_t>(p)];
    // An open sheet encloses nothing much: it keeps its sides.
    return part.volume_mm3 < 0 && (part.closed || -part.volume_mm3 > 0.05 * part.box.volume());
  };
  std::vector<bool> turn(parts.parts.size());
  std::int64_t count = 0;
  for (std::size_t p = 0; p < turn.size(); ++p) count += turn[p] = inward(static_cast<std::int32_t>(p));
  for (std::size_t f = 0; f < soup.triangles.size(); ++f) {
    if (turn[static_cast<std::size_t>(parts.classes.of[f])])
      std::swap(soup.triangles[f][1], soup.triangles[f][2]);
  }
  return count;
}

SurfaceMesh compacted(const Soup& soup) {
  std::vector<std::int32_t> number(soup.points.size(), -1);
  std::vector<std::int32_t> used;
  SurfaceMesh mesh;
  mesh.F.resize(static_cast<Eigen::Index>(soup.triangles.size()), 3);
  for (std::size_t f = 0; f < soup.triangles.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::int32_t v = soup.triangles[f][c];
      std::int32_t& n = number[static_cast<std::size_t>(v)];
      if (n < 0) {
        n = static_cast<std::int32_t>(used.size());
        used.push_back(v);
      }
      mesh.F(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(c)) = n;
    }
  }
  mesh.V.resize(static_cast<Eigen::Index>(used.size()), 3);
  for (std::size_t n = 0; n < used.size(); ++n) {
    const Eigen::Vector3f p = soup.points[static_cast<std::size_t>(used[n])].cast<float>();
    mesh.V.row(static_cast<Eigen::Index>(n)) = p.cast<double>().transpose();
  }
  return mesh;
}

}  // namespace

Triangles Soup::F() const {
  Triangles out(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c)
      out(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(c)) = triangles[f][c];
  }
  return out;
}

SurfaceMesh Soup::mesh() const {
  SurfaceMesh out{Points(static_cast<Eigen::Index>(points.size()), 3), F()};
  for (std::size_t v = 0; v < points.size(); ++v)
    out.V.row(static_cast<Eigen::Index>(v)) = points[v].transpose();
  return out;
}

bool Done::anything() const {
  return welded + degenerate + duplicates + fins + turned + split + specks + holes + flat + outward + inner >
         0;
}

Mended repair_surface(const SurfaceMesh& surface, const Options& options, const Context& context) {
  Done done;
  Soup soup = as_files_hold_it(surface);
  drop_bad(soup, done);
  done.welded = weld_open_edges(soup, options.weld_mm);
  drop_bad(soup, done);
  context.check_stop();
  done.fins = drop_fins(soup);
  done.turned = orient(soup);
  done.split = split_sheets(soup);
  done.fins += drop_lone(soup);
  context.check_stop();
  done.specks = drop_parts(soup, [&](const check::SurfaceParts& parts, std::int32_t p) {
    return parts.speck(p, options.speck_mm);
  });
  const Filled filled = fill_holes(soup, options.hole_mm * options.hole_mm, context);
  done.holes = filled.holes;
  done.filling = filled.triangles;
  done.holes_left = filled.left;
  done.flat = swap_flat(soup);
  context.check_stop();
  if (options.drop_inner) {
    done.inner = drop_parts(soup, [](const check::SurfaceParts& parts, std::int32_t p) {
      return parts.parts[static_cast<std::size_t>(p)].inside >= 0;
    });
  }
  done.outward = turn_outward(soup);
  return {compacted(soup), done};
}

}  // namespace ecorche::repair
