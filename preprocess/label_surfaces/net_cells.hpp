// SPDX-License-Identifier: Apache-2.0
// The ways in which a surface can pass a cell of eight voxel centres.
#pragma once

#include <array>
#include <cstdint>

namespace ecorche::label_surfaces {

/// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2). Edge 4 * axis + n joins kEdgeCorners of it; face
/// 2 * axis + side has that coordinate equal to side.
inline constexpr std::array<std::array<std::uint8_t, 2>, 12> kEdgeCorners{
    {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};

/// Where the surface of the inside corners crosses a cell: closed loops over its faces, one vertex each.
struct CellLoops {
  std::uint8_t count = 0;
  std::array<std::int8_t, 12> of_edge{};  ///< loop that crosses each edge, -1: not crossed
  std::array<std::uint16_t, 4> edges{};   ///< of each loop, one bit per crossed edge
  std::uint8_t pinched = 0;               ///< one bit per face whose two crossings belong to one loop
};

/// The edge between two corners that differ in one coordinate.
int edge_between(int a, int b);

/// By the eight bits of the inside corners. On a face whose inside corners are diagonal, the surface goes
/// round each of the outside corners on its own: voxels that share an edge are joined, as in a skin one voxel
/// thick; those that touch only by a corner are apart.
const std::array<CellLoops, 256>& cell_loops();

}  // namespace ecorche::label_surfaces
