// SPDX-License-Identifier: Apache-2.0
// The volume that a posed surface encloses, by few of its vertices.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::runtime {

/// A closed surface whose vertices are some of another's.
struct CoarseSurface {
  std::vector<std::uint32_t> vertex;                   ///< rows of the whole surface's vertices, each once
  std::vector<std::array<std::uint32_t, 3>> triangle;  ///< rows of `vertex`
  double rest_6 = 0;                                   ///< six times its signed volume at rest, mm^3
};

/// `V` and `F` with all vertices in one cell of a grid of `edge` mm drawn together to the one that is nearest
/// to their mean, and without the triangles that have no three corners left (RossignacBorrel93). What was
/// closed stays closed, since a map of vertices keeps the boundary of a cycle. #F >= 1.
CoarseSurface cluster_vertices(const PointsF& V, const Triangles& F, float edge);

/// A coarse surface of about `triangles` triangles whose volume at rest keeps to a fifth of the whole
/// surface's, then one on cells sqrt 2 times as wide. What clustering gets wrong grows as the cells' square,
/// so the difference of what the two say of a pose is the error of the first (Richardson). A surface that has
/// no more than twice as many triangles, or needs more than half of its own, is returned itself, alone.
std::vector<CoarseSurface> coarsen(const PointsF& V, const Triangles& F, std::size_t triangles);

/// Six times the signed volume with the whole surface's vertices at `vertices`, 3 * #V, about its first one.
double volume_6(const CoarseSurface& surface, std::span<const float> vertices);

}  // namespace ecorche::runtime
