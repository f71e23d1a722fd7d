// SPDX-License-Identifier: Apache-2.0
// The proximity buffer of Gagvani01 5.2, a small cube of voxels at a time: to which ball does each voxel
// belong?
//
// Of the balls that hold a voxel's centre, the one whose centre is nearest owns it; of two as near, the one
// of the lower row. Bridges own only what no ball of the body holds. Centres are rounded to 1/16 voxel and
// all distances are whole numbers of 1/256 square voxels: exact, so that neither the cut into cubes nor the
// number of threads can change an owner.
//
// A ball that holds a whole cube bounds the distance of its voxels to their owners, so most balls that reach
// a cube can own nothing of it. Cubes of 16 are halved until 4, and each hands on to its eighths only the
// balls that may still count there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ecorche::runtime {

constexpr int kTileEdge = 4;
constexpr std::size_t kTileVoxels = kTileEdge * kTileEdge * kTileEdge;
/// Balls may be no larger, voxels: so that squared distances fit 32 bits.
constexpr double kMostRadius = 1000;

/// The balls that may count in a cube, rows ascending: one array per number, for vectors of balls.
struct CubeBalls {
  std::vector<std::int32_t> x, y, z;  ///< centres, sixteenths of a voxel from the cube's first voxel
  std::vector<std::int32_t> limit;    ///< 256 times the squared radius, rounded up: it holds what is nearer
  std::vector<std::int32_t> row;
  std::vector<std::int32_t> least;  ///< squared distance to the cube's nearest voxel: scratch of `narrow`
  std::size_t size = 0;             ///< the arrays are longer: vectors write beyond the end
  std::int32_t bridges_from = 0;    ///< as BallSet has it

  void clear() { size = 0; }
  /// Room for `count` balls.
  void reserve(std::size_t count);
  void push(std::int32_t x_, std::int32_t y_, std::int32_t z_, std::int32_t limit_, std::int32_t row_);
};

/// The owners of a cube of 4, i fastest.
struct TileOwners {
  static constexpr std::int32_t none = -1;
  alignas(64) std::array<std::int32_t, kTileVoxels> owner;
};

namespace kernels {

/// Those balls of `in` that may own a voxel of the cube of `edge` voxels that begins `offset` voxels from
/// that of `in`, seen from there.
void narrow(CubeBalls& in, const std::array<std::int32_t, 3>& offset, std::int32_t edge, CubeBalls& out);

/// True where any voxel of the cube of 4 has an owner.
bool draw(const CubeBalls& balls, TileOwners& out);

}  // namespace kernels

}  // namespace ecorche::runtime
