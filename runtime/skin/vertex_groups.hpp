// SPDX-License-Identifier: Apache-2.0
// The vertices of one tissue as the kernel of tissues reads them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/values/model.hpp"
#include "runtime/skin/aligned.hpp"

namespace ecorche::runtime {

/// Vertices in groups of 16, each over one palette of nodes, so that a node is fetched once for all its
/// vertices and found again by a byte. In the tissue's own order where that is local, and then written in
/// one go; else along a Morton curve, and then each vertex to its place.
struct VertexGroups {
  static constexpr std::size_t size = 16;
  static constexpr std::size_t most_lanes = 4 * size;

  struct Group {
    std::uint32_t palette;  ///< first of its palette in `rows`
    std::uint32_t count;    ///< of its palette: 8, 16 .. 64
    std::uint32_t data;     ///< first of its 3 * 16 numbers, in `narrow` or in `wide`
    float low, step;        ///< narrow: b = low + step * number; step 0: the numbers are in `wide`
  };

  std::size_t vertices = 0;
  bool in_order = true;  ///< group g holds the vertices from 16 g
  std::vector<Group> groups;
  std::vector<std::uint32_t> vertex;  ///< 16 * #groups, place of each; empty when in order
  Aligned<std::uint32_t> rows;        ///< palettes, filled up with their last entry: 3 * lane of NodeClusters
  Aligned<std::uint8_t> corner;       ///< 4 x 16 a group: the corners of the vertices' tets in the palette
  Aligned<std::uint16_t> narrow;      ///< 3 x 16 a group: barycentric coordinates of corners 1, 2, 3
  Aligned<float> wide;                ///< the same, where 16 bits would move a vertex by more than 2e-4 mm
  Aligned<std::int16_t> normal;       ///< 3 x 16 a group: see `normal_shares`

  std::size_t group_vertices(std::size_t group) const {
    return group + 1 < groups.size() ? size : vertices - size * group;
  }
  std::size_t vertex_at(std::size_t place) const { return in_order ? place : vertex[place]; }
};

/// `lane`: of NodeClusters. The tissue hangs on tets (`tet`, `barycentric` as Tissue says).
VertexGroups group_vertices(const Model& model, const Tissue& tissue, std::span<const std::uint32_t> lane);

/// #V by 3, unit normals of the rest surface, each the sum of its triangles' by area; zero where there are
/// none.
PointsF rest_normals(const Tissue& tissue);

/// The shares g of the posed normal n' ~ g1 e2 x e3 + g2 e3 x e1 + g3 e1 x e2, e the posed edges of the
/// vertex' tet from its first corner: the cofactor of the deformation times the rest normal n gives
/// g_i = e_i . n. Largest is 1; zero where n is.
Eigen::Vector3f normal_shares(const Model& model, std::int32_t tet, const Eigen::Vector3f& normal);

}  // namespace ecorche::runtime
