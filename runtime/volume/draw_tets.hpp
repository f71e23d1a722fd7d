// SPDX-License-Identifier: Apache-2.0
// Posed tets into the rows of voxels that they hold, each voxel with its place in the rest volume
// (Sujar18 4, the inverse map).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <ecorche/runtime/bricks.hpp>
#include <ecorche/values/mesh.hpp>
#include "runtime/volume/tet_palettes.hpp"

namespace ecorche::runtime {

/// Voxels on their way to be sampled, planar. Sampled in order: a later voxel overwrites an earlier one.
struct VoxelBatch {
  static constexpr std::size_t capacity = 512;  ///< in the first cache, beside all else
  std::size_t count = 0;
  static constexpr std::size_t most_lanes = 16;  ///< a vector may be stored at `count`, whatever it is
  static constexpr std::size_t held = capacity + most_lanes;
  alignas(64) std::array<std::uint32_t, held> offset;              ///< in the posed grid
  alignas(64) std::array<std::array<std::int32_t, held>, 3> base;  ///< of the place: base + part, in
  alignas(64) std::array<std::array<float, held>, 3> part;         ///< continuous indices of the volume
};

/// What a full batch is handed to; `to` is the sampler's own.
struct BatchSink {
  void (*sample)(const void* to, const VoxelBatch& batch);
  const void* to;
};

/// Which tets to draw: those of positive posed volume, or those that lie the wrong way round (zero too).
enum class Claim : std::uint8_t { positive, inverted };

/// Where drawing met inverted tets that it left out: a handful of boxes that hold all their voxels of the
/// range drawn. Near ones share one.
struct Inverted {
  static constexpr std::size_t most = 16;
  std::size_t count = 0;
  std::array<VoxelRange, most> box;

  void add(const VoxelRange& voxels);
};

/// A job on tets of one posed body; owns nothing, allocates nothing. Corners and axes as whole numbers of
/// 2^-bits voxels (fixed_points.hpp).
struct DrawTets {
  const DrawnTets& tets;
  const TetPalettes& palettes;          ///< of `tets` in their own order, 3 numbers a node
  std::span<const std::int32_t> posed;  ///< 3 * #nodes and one more, indices of the posed grid
  std::span<const std::int32_t> rest;   ///< 3 * #nodes and one more, indices of the volume
  int bits = 20;
  /// Both grids are one lattice (spacing and direction): the map is then made as what it differs from a
  /// shift, so that a body at rest gives every voxel back exactly.
  bool same_lattice = false;
  bool left_handed = false;            ///< the posed grid's axes turn the sign of every volume
  std::array<std::int32_t, 3> size{};  ///< of the posed grid
  BrickMask only{};                    ///< tets and voxels of other bricks are left out
};

/// Tets whose determinant is below this share of the longest side of their box cubed are drawn in double
/// precision.
inline constexpr float kFlatTet = 3e-3F;

namespace kernels {

/// Of the runs from `first` on the voxel centres of `range` that their boxes hold: `nothing` where there is
/// none, or only such of bricks that are not drawn.
void box_runs(const DrawTets& job, const VoxelRange& range, std::size_t first, std::span<VoxelRange> boxes);

/// Sets `moved` of every brick of `bricks` that a tet of [begin, end), where `begin` begins a run, may hold
/// voxels of at `before` or at `job.posed`, where a corner of it differs between the two. `range`: the whole
/// grid. Several may run at once.
void mark_moved(const DrawTets& job, std::span<const std::int32_t> before, const VoxelRange& range,
                const Bricks& bricks, std::size_t begin, std::size_t end, std::uint8_t* moved);

/// Puts the voxels of `range` that those tets of `runs` hold whose claim it is into `batch`: runs in their
/// order, tets of a run from the last to the first. The batch goes to `sink` whenever it is full, not at the
/// end. Every voxel whose centre lies in the closed tet is drawn; one that lies outside by less than about
/// 1e-5 of the tet's size (of a voxel, where that is more) may be. Where positive ones are drawn, inverted
/// ones are told to `found`.
void draw_runs(const DrawTets& job, const VoxelRange& range, std::span<const std::uint32_t> runs, Claim claim,
               VoxelBatch& batch, const BatchSink& sink, Inverted& found);

}  // namespace kernels

/// One tet, however flat, in double precision: the slow way for the few that need it.
void draw_flat_tet(const DrawTets& job, const VoxelRange& range, std::uint32_t id, VoxelBatch& batch,
                   const BatchSink& sink);

/// Six times the posed volume of a tet, cubed voxels, from whole numbers: its sign is right unless it is
/// below 1e-15 of the longest edge cubed. Left-handed grids are allowed for.
double posed_det(const DrawTets& job, std::uint32_t id);

}  // namespace ecorche::runtime
