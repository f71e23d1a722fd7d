// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/fill_gaps.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "core/geometry/surface_edges.hpp"
#include "preprocess/repair/soup.hpp"

namespace ecorche::parting {
namespace {

using Corners = std::array<std::int32_t, 3>;

// The triangles about some vertices, apart from the others.
struct Surroundings {
  std::vector<Corners> about, others;

  Surroundings(const Triangles& F, const std::set<std::int32_t>& vertices) {
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
      const Corners t{F(f, 0), F(f, 1), F(f, 2)};
      const bool near =
          std::any_of(t.begin(), t.end(), [&](std::int32_t v) { return vertices.count(v) != 0; });
      (near ? about : others).push_back(t);
    }
  }
};

// Those that hang on no other, and are none of the skin's first `given` vertices.
void drop_lone_triangles(repair::Soup& soup, Eigen::Index given) {
  std::vector<int> open(soup.triangles.size(), 0);
  geometry::each_edge(geometry::sorted_edges(soup.F()), [&](std::span<const geometry::HalfEdge> edge) {
    if (edge.size() == 1) ++open[static_cast<std::size_t>(edge[0].triangle)];
  });
  std::size_t kept = 0;
  for (std::size_t f = 0; f < open.size(); ++f) {
    const Corners& triangle = soup.triangles[f];
    const bool of_skin =
        std::any_of(triangle.begin(), triangle.end(), [&](std::int32_t v) { return v < given; });
    if (open[f] < 3 || of_skin) soup.triangles[kept++] = triangle;
  }
  soup.triangles.resize(kept);
}

}  // namespace

void fill_gaps(Tissue& skin, const std::set<std::int32_t>& rim, Eigen::Index own, const PartedTets& tets,
               const Context& context) {
  const Surroundings given(skin.F, rim);
  repair::Soup soup;
  for (Eigen::Index v = 0; v < skin.V.rows(); ++v)
    soup.points.emplace_back(skin.V.row(v).cast<double>().transpose());
  soup.triangles = given.about;
  repair::split_sheets(soup);
  const auto before = static_cast<std::int32_t>(skin.V.rows());
  std::vector<NewVertex> added;
  for (std::size_t v = static_cast<std::size_t>(before); v < soup.points.size(); ++v)
    added.push_back({soup.points[v]});
  std::vector<std::uint8_t> known(added.size(), 0);
  const auto is_known = [&](std::int32_t v) {
    return v < before || known[static_cast<std::size_t>(v - before)] != 0;
  };
  const auto part = [&](std::int32_t v) {
    return v < before ? tets.part_of(skin.tet[static_cast<std::size_t>(v)])
                      : added[static_cast<std::size_t>(v - before)].part;
  };
  for (std::size_t f = 0; f < given.about.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::int32_t was = given.about[f][c];
      std::int32_t& v = soup.triangles[f][c];
      if (rim.count(was) == 0) v = was;  // what lies about it is not all here
      if (is_known(v)) continue;
      added[static_cast<std::size_t>(v - before)].part = part(was);
      known[static_cast<std::size_t>(v - before)] = 1;
    }
  }
  // Of vertices in the middle of split edges the side of one beside.
  for (bool spreads = true; spreads;) {
    spreads = false;
    for (const Corners& triangle : soup.triangles) {
      const auto beside = std::find_if(triangle.begin(), triangle.end(), is_known);
      if (beside == triangle.end()) continue;
      for (const std::int32_t v : triangle) {
        if (is_known(v)) continue;
        added[static_cast<std::size_t>(v - before)].part = part(*beside);
        known[static_cast<std::size_t>(v - before)] = 1;
        spreads = true;
      }
    }
  }
  repair::fill_holes(
      soup, std::numeric_limits<double>::max(), context.quiet(), [&](const std::vector<std::int32_t>& loop) {
        return std::all_of(loop.begin(), loop.end(), [&](std::int32_t v) {
          return (v >= before || rim.count(v) != 0) &&
                 (part(v) == part(loop[0]) ||
                  tets.near_joined(part(v), part(loop[0]), soup.points[static_cast<std::size_t>(v)]));
        });
      });
  drop_lone_triangles(soup, own);
  soup.triangles.insert(soup.triangles.end(), given.others.begin(), given.others.end());
  append_vertices(skin, added, tets, context);
  skin.F = soup.F();
}

}  // namespace ecorche::parting
