// SPDX-License-Identifier: Apache-2.0
// Which ball owns each voxel of any box of the lattice, a tile at a time: what refilling, losses and the
// search for tears are made of.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include <ecorche/runtime/bricks.hpp>
#include <ecorche/values/context.hpp>
#include "runtime/spheres/balls.hpp"
#include "runtime/spheres/tile_owners.hpp"

namespace ecorche::runtime {

/// A box of lattice voxels, which may lie beyond the lattice's own extent.
struct LatticeBox {
  std::array<std::int32_t, 3> first{0, 0, 0};
  std::array<std::int32_t, 3> size{0, 0, 0};

  bool operator==(const LatticeBox&) const = default;
};

/// The grid whose voxels are those of the box.
ImageGrid grid_of(const ImageGrid& lattice, const LatticeBox& box);

/// The smallest box that holds the lattice and every voxel that some ball may hold. Throws Error{data} beyond
/// 2^31 voxels, for a ball that is not finite or larger than kMostRadius.
LatticeBox grown_box(const BallSet& set);

/// The voxels whose centres lie in the LPS box from `low` to `high`, mm, both ends included: empty where none
/// do.
LatticeBox box_within(const ImageGrid& lattice, const Vec3& low, const Vec3& high);

/// A tile that something lies in.
struct Tile {
  std::array<std::int32_t, 3> first;  ///< voxel of the box
  std::array<std::int32_t, 3> size;   ///< at most kTileEdge; less at the far sides of the box
  const TileOwners* owners;

  /// Calls f(i, j, k, owner) for every owned voxel, indices of the box.
  template <class F>
  void for_owned(F&& f) const {
    for (std::int32_t k = 0; k < size[2]; ++k) {
      for (std::int32_t j = 0; j < size[1]; ++j) {
        const std::int32_t* row = owners->owner.data() + kTileEdge * (j + kTileEdge * k);
        for (std::int32_t i = 0; i < size[0]; ++i) {
          if (row[i] != TileOwners::none) f(first[0] + i, first[1] + j, first[2] + k, row[i]);
        }
      }
    }
  }
};

/// Calls `f` once for every tile of the box that holds an owned voxel, from any thread and in any order; with
/// a mask, of its bricks only (bricks of the box). Throws as grown_box, and Error{interrupted} on a stop.
void for_tiles(const BallSet& set, const LatticeBox& box, const Context& context,
               const std::function<void(const Tile&)>& f, const BrickMask& mask = {});

/// Of every voxel of the box the row of the ball that owns it, TileOwners::none where none does. Throws as
/// for_tiles.
std::vector<std::int32_t> owners_of(const BallSet& set, const LatticeBox& box, const Context& context = {});

}  // namespace ecorche::runtime
