// SPDX-License-Identifier: Apache-2.0
// Posed tets into the rows of voxels that they hold, each voxel with its place in the rest volume
// (Sujar18 4, the inverse map).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/values/mesh.hpp"
#include "runtime/volume/bricks.hpp"
#include "runtime/volume/tet_palettes.hpp"

namespace ecorche::runtime {

/// Voxels on their way to be sampled, planar. Sampled in order: a later voxel overwrites an earlier one.
struct VoxelBatch {
  static constexpr std::size_t capacity = 1024;
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

/// Where one tet may hold voxels, and how it lies.
struct TetExtent {
  static constexpr std::uint16_t none = 0xffff;
  std::uint16_t first = none, last = 0;  ///< bands; first > last: it holds no voxel of the range
};

/// A job on tets of one posed body; owns nothing, allocates nothing. Corners and axes as whole numbers of
/// 2^-bits voxels (fixed_points.hpp).
struct DrawTets {
  const Tets& tets;
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

/// Tets whose determinant is below this share of their longest edge cubed are drawn in double precision.
inline constexpr float kFlatTet = 1e-3F;

namespace kernels {

/// For tets [begin, end), where `begin` begins a run: the bands of `band` slices along `axis` (from
/// range.first on) of the voxel centres that its box holds. Returns how many of them lie the wrong way round
/// (posed volume zero or less) and hold some; those are written to `inverted`, ascending, and left out of
/// `extents` (which has end - begin entries).
std::size_t classify_tets(const DrawTets& job, const VoxelRange& range, int axis, std::int32_t band,
                          std::size_t begin, std::size_t end, std::span<TetExtent> extents,
                          std::span<std::uint32_t> inverted);

/// Sets `moved` of every brick of `bricks` that a tet of [begin, end), where `begin` begins a run, may hold
/// voxels of at `before` or at `job.posed`, where a corner of it differs between the two. `range`: the whole
/// grid. Several may run at once.
void mark_moved(const DrawTets& job, std::span<const std::int32_t> before, const VoxelRange& range,
                const Bricks& bricks, std::size_t begin, std::size_t end, std::uint8_t* moved);

/// Puts the voxels of `range` that the tets `ids` hold, in that order, into `batch`, which goes to `sink`
/// whenever it is full, not at the end. Every voxel whose centre lies in the closed tet is drawn; one that
/// lies outside by less than about 1e-5 of the tet's size may be.
void draw_tets(const DrawTets& job, const VoxelRange& range, std::span<const std::uint32_t> ids,
               VoxelBatch& batch, const BatchSink& sink);

/// The same for tets of the runs from `first` on, the last first: those whose entry of `wanted`, sixteen a
/// run, is not zero.
void draw_runs(const DrawTets& job, const VoxelRange& range, std::size_t first,
               std::span<const std::uint8_t> wanted, VoxelBatch& batch, const BatchSink& sink);

}  // namespace kernels

/// One tet, however flat, in double precision: the slow way for the few that need it.
void draw_flat_tet(const DrawTets& job, const VoxelRange& range, std::uint32_t id, VoxelBatch& batch,
                   const BatchSink& sink);

/// Six times the posed volume of a tet, cubed voxels, from whole numbers: its sign is right unless it is
/// below 1e-15 of the longest edge cubed. Left-handed grids are allowed for.
double posed_det(const DrawTets& job, std::uint32_t id);

}  // namespace ecorche::runtime
