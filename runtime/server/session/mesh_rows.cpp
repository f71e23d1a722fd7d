// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/mesh_rows.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <limits>

namespace ecorche::server {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kFewestTriangles = 64;  // a bone of fewer is no bone any more
// Of the extent of a tissue: what an edge collapse may move the surface by.
constexpr float kMostError = 0.1F;

// `corners`: rows of the tissue. Vertices without a triangle are left out.
MeshRows rows_of(const std::vector<std::uint32_t>& corners, std::size_t vertices) {
  std::vector<std::uint32_t> row(vertices, kNone);
  for (const std::uint32_t v : corners) row[v] = 0;
  MeshRows rows;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (row[v] == kNone) continue;
    row[v] = static_cast<std::uint32_t>(rows.vertices.size());
    rows.vertices.push_back(v);
  }
  for (const std::uint32_t v : corners) rows.triangles.push_back(row[v]);
  return rows;
}

std::vector<std::uint32_t> all_corners(const Tissue& tissue) {
  return {tissue.F.data(), tissue.F.data() + tissue.F.size()};
}

}  // namespace

MeshLevels make_levels(const Tissue& tissue) {
  MeshLevels levels;
  const auto vertices = static_cast<std::size_t>(tissue.V.rows());
  std::vector<std::uint32_t> corners = all_corners(tissue), coarser(corners.size());
  for (MeshRows& level : levels) {
    const std::size_t target = std::max(corners.size() / 12, kFewestTriangles) * 3;
    if (corners.size() > target) {
      coarser.resize(corners.size());
      coarser.resize(meshopt_simplify(coarser.data(), corners.data(), corners.size(), tissue.V.data(),
                                      vertices, 3 * sizeof(float), target, kMostError));
      if (!coarser.empty()) corners.swap(coarser);
    }
    level = rows_of(corners, vertices);
  }
  return levels;
}

MeshRows cut(const Tissue& tissue, const MeshRows* from, const runtime::Region& box) {
  const auto inside = [&](std::uint32_t v) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double x = tissue.V(v, static_cast<Eigen::Index>(c));
      if (x < box.low[c] || x > box.high[c]) return false;
    }
    return true;
  };
  const auto count =
      static_cast<std::uint32_t>(from ? from->vertices.size() : static_cast<std::size_t>(tissue.V.rows()));
  std::vector<std::uint32_t> row(count, kNone);
  MeshRows rows;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t v = from ? from->vertices[i] : i;
    if (!inside(v)) continue;
    row[i] = static_cast<std::uint32_t>(rows.vertices.size());
    rows.vertices.push_back(v);
  }
  const std::vector<std::uint32_t> corners = from ? from->triangles : all_corners(tissue);
  for (std::size_t f = 0; f + 2 < corners.size(); f += 3) {
    if (row[corners[f]] == kNone || row[corners[f + 1]] == kNone || row[corners[f + 2]] == kNone) continue;
    for (std::size_t c = 0; c < 3; ++c) rows.triangles.push_back(row[corners[f + c]]);
  }
  return rows;
}

}  // namespace ecorche::server
