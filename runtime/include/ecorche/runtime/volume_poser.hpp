// SPDX-License-Identifier: Apache-2.0
// Posed volumes in one pass: the inverse map of each deformed tet (Sujar18 4), drawn and sampled at once.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <ecorche/runtime/bricks.hpp>
#include <ecorche/runtime/held_arrays.hpp>
#include <ecorche/runtime/resample.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// One volume kept posed from pose to pose, for one subscriber: VolumePoser::follow makes only those bricks
/// again that moved. Others read `image`, `bricks`, `moved` and `rewritten`, and touch nothing.
struct PosedVolume {
  Image image;                           ///< on the grid of the last call
  Bricks bricks;                         ///< of that grid
  std::vector<std::uint8_t> moved;       ///< a brick each: 1 where the last call made it again
  std::vector<std::uint32_t> rewritten;  ///< those bricks, ascending

  /// Of VolumePoser: what `image` shows.
  struct Drawn {
    const ModelVolume* volume = nullptr;  // null: nothing yet, or only half of it
    Sampling sampling = Sampling::trilinear;
    int bits = 0;
    std::size_t nodes = 0;  // numbers given
    std::vector<std::int32_t> posed;
  } drawn;
};

/// Made once per model; shared and immutable, as BodyPoser is.
class VolumePoser {
 public:
  /// Kept by the caller from pose to pose, so that nothing of the body's size is allocated again.
  struct Scratch {
    std::vector<float> bounds, copied;
    std::vector<std::int32_t> posed, rest;
    std::vector<VoxelRange> runs, stretches;  // boxes of runs of tets, and of some that follow each other
    std::vector<std::uint8_t> sides, block_meets, groups;
    /// What the scratch holds of the scan.
    struct Rest {  // what `rest` holds
      const Model* model = nullptr;
      ImageGrid grid;
      int bits = 0;
    } of_rest;
  };

  /// Keeps the model.
  explicit VolumePoser(std::shared_ptr<const Model> model);
  ~VolumePoser();

  /// `volume` carried along onto `grid`, which may be any: the grown lattice (grow_to), a region of interest,
  /// a slice. As locate() and resample(), its slow twins: a voxel belongs to the tets that hold its centre,
  /// those of positive posed volume before inverted ones, then to the lowest drawn index (rigid_copies.hpp:
  /// bones first, then what is contested as rigid as they are); where none does, it is `background`. Rest
  /// points agree with them to 1e-3 voxel; where a centre lies within 1e-5 of a tet's size of its face, a tet
  /// may win that does not hold it. At rest, on the volume's own lattice, every voxel inside is given back
  /// exactly. `out` is made anew unless it has that grid, type and components already. Same bytes for any
  /// number of threads. Error{data} for a grid of more than 2^31 voxels, Error{interrupted} on a stop.
  void pose(std::span<const float> nodes, const ModelVolume& volume, Sampling sampling, const ImageGrid& grid,
            Image& out, Scratch& scratch, const Context& context = {}) const;

  /// As pose(), into `kept.image`, byte for byte; but where `kept` shows the same `volume` (the same object,
  /// unchanged) on the same grid, only the bricks that a tet left, came to or moved within are made again.
  /// Nothing is allocated where the last call with `kept` and `scratch` was of the same sizes. After an error
  /// the next call makes all bricks again.
  void follow(std::span<const float> nodes, const ModelVolume& volume, Sampling sampling,
              const ImageGrid& grid, PosedVolume& kept, Scratch& scratch, const Context& context = {}) const;

  /// What is posed.
  const Model& model() const;

  /// What it holds besides the model; made now where that would have waited for the first volume.
  HeldArrays arrays() const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

/// `volume` carried along: a VolumePoser for one call.
Image pose_volume(std::shared_ptr<const Model> model, std::span<const float> nodes, const ModelVolume& volume,
                  Sampling sampling, const ImageGrid& grid, const Context& context = {});

}  // namespace ecorche::runtime
