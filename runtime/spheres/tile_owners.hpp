// SPDX-License-Identifier: Apache-2.0
// The proximity buffer of Gagvani01 5.2, a tile at a time: to which ball does each voxel belong?
//
// Of the balls that hold a voxel's centre, the one whose centre is nearest owns it; of two as near, the one
// of the lower row. Centres are rounded to 1/16 voxel and all distances are whole numbers of 1/256 square
// voxels: exact, so that neither the order of the balls, nor the cut into tiles, nor the number of threads
// can change an owner.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace ecorche::runtime {

constexpr int kTileEdge = 8;
constexpr int kTileVoxels = kTileEdge * kTileEdge * kTileEdge;
/// Balls may be no larger, voxels: so that squared distances fit 32 bits.
constexpr double kMostRadius = 2000;

/// A ball as a tile sees it: sixteenths of a voxel from the centre of the tile's first voxel.
struct TileBall {
  std::int32_t x, y, z;
  std::int32_t limit;  ///< 256 times the squared radius, rounded up: it holds what is strictly nearer
  std::int32_t row;
  std::int32_t least;  ///< no voxel of the tile is nearer than this, 1/256 square voxels
};

/// One tile, i fastest.
struct TileOwners {
  static constexpr std::int32_t none = -1;
  alignas(64) std::array<std::int32_t, kTileVoxels> owner;
  /// Squared distance to the owner less 256 i^2, which is linear along a row.
  alignas(64) std::array<std::int32_t, kTileVoxels> proximity;
};

/// Sorts `balls` near first and draws them until none that is left can own anything. Fills `out`; true where
/// any voxel has an owner.
bool draw_tile(std::vector<TileBall>& balls, TileOwners& out);

namespace kernels {
void clear(TileOwners& out);
/// Draws some balls, in any order.
void draw(std::span<const TileBall> balls, TileOwners& out);
/// The largest squared distance of a voxel to its owner, or the largest number where one has none.
std::int32_t farthest(const TileOwners& tile);
}  // namespace kernels

}  // namespace ecorche::runtime
