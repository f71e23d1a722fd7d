// SPDX-License-Identifier: Apache-2.0
// The vertices of one tissue as the kernel of tissues reads them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/aligned.hpp>
#include <ecorche/values/model.hpp>
#include "runtime/skin/node_clusters.hpp"
#include "runtime/skin/tissue_nodes.hpp"

namespace ecorche::runtime {

/// Vertices in groups of 16, and groups that lie near each other in cells, each over one palette of nodes: a
/// node is fetched once for all vertices of a cell and found again by a byte. A group's vertices follow each
/// other in the tissue's own order where that is local, and are then written in one go; else along a Morton
/// curve, and then each vertex to its place. Cells are sorted by the slab of the last of their nodes.
struct VertexGroups {
  static constexpr std::size_t size = 16;
  static constexpr std::size_t most_lanes = 4 * size;  ///< of a palette
  static constexpr std::size_t most_groups = 8;        ///< of a cell

  struct Cell {
    std::uint32_t palette;  ///< first of its palette in `rows`
    std::uint32_t count;    ///< of its palette: 16, 32, 48 or 64
    std::uint32_t end;      ///< after its last group; its first is where the cell before ends
  };
  struct Group {
    std::uint32_t first;  ///< place of its first vertex
    std::uint32_t data;   ///< first of its 3 * 16 numbers, in `narrow` or in `wide`
    float low, step;      ///< narrow: b = low + step * number; step 0: the numbers are in `wide`
  };

  std::size_t vertices = 0;
  bool in_order = true;  ///< places are the tissue's own
  std::vector<Cell> cells;
  std::vector<Group> groups;
  std::vector<std::uint32_t> vertex;  ///< 16 * #groups, the vertex at each place; empty when in order
  Aligned<std::uint32_t> rows;        ///< palettes, filled up with their last entry: 3 * lane of NodeClusters
  /// 16 a group: the corners of a vertex' tet in the palette, a byte each, corner 0 lowest. Corners 1 to 3
  /// are turned so that the normal's first share is the largest and positive.
  Aligned<std::uint32_t> corners;
  Aligned<std::uint16_t> narrow;  ///< 3 x 16 a group: barycentric coordinates of corners 1, 2, 3
  Aligned<float> wide;            ///< the same, where 16 bits would move a vertex by more than 2e-4 mm
  /// 2 x 16 a group, 32767ths: shares 2 and 3 of `normal_shares` over share 1; `no_normal` where n is zero.
  Aligned<std::int16_t> normal;
  static constexpr std::int16_t no_normal = -32768;

  static constexpr std::size_t slab_floats = 3 * NodeClusters::slab;  ///< posed, of a slab

  std::size_t group_vertices(const Group& group) const {
    return group.first + size <= vertices ? size : vertices - group.first;
  }
  std::size_t first_group(std::size_t cell) const { return cell == 0 ? 0 : cells[cell - 1].end; }
  /// Slabs of NodeClusters that a cell's nodes lie in, the first and the last: palettes are sorted.
  std::size_t first_slab(const Cell& cell) const { return rows[cell.palette] / slab_floats; }
  std::size_t last_slab(const Cell& cell) const { return rows[cell.palette + cell.count - 1] / slab_floats; }
};

/// `hold`: the tissue's nodes; `lane`: of NodeClusters. The tissue hangs on tets (`tet`, `barycentric` as
/// Tissue says).
VertexGroups group_vertices(const Model& model, const Tissue& tissue, const TissueNodes& hold,
                            std::span<const std::uint32_t> lane);

/// #V by 3, unit normals of the rest surface, each the sum of its triangles' by area; zero where there are
/// none.
PointsF rest_normals(const Tissue& tissue);

/// The shares g of the posed normal n' ~ g1 e2 x e3 + g2 e3 x e1 + g3 e1 x e2, e the posed edges of the
/// vertex' tet from its first corner: the cofactor of the deformation times the rest normal n gives
/// g_i = e_i . n, with the edges at rest, a column each. Largest is 1; zero where n is.
Eigen::Vector3f normal_shares(const Eigen::Matrix3f& edges, const Eigen::Vector3f& normal);

}  // namespace ecorche::runtime
