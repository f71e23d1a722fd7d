// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/volume_poser.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "runtime/volume/fixed_points.hpp"
#include "runtime/volume/grid_affine.hpp"
#include "runtime/volume/sample_batch.hpp"
#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::int32_t kBand = 16;  // slices of a task: a few tets high
constexpr std::size_t kBlocksPerTask = 128;
constexpr double kMostVoxels = 2147483648.0;

// Slices of the grid in bands, along its longer one of the two slow axes: a slice plane has only one slice.
struct Bands {
  int axis = 2;
  std::int32_t height = kBand;
  std::size_t count = 0;

  explicit Bands(const ImageGrid& grid) : axis(grid.size[2] >= grid.size[1] ? 2 : 1) {
    const std::int32_t slices = grid.size[static_cast<std::size_t>(axis)];
    height = std::max(kBand, slices / 32768);
    count = static_cast<std::size_t>((slices + height - 1) / height);
  }
  VoxelRange of(std::size_t band, const ImageGrid& grid) const {
    VoxelRange range{{}, {grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1}};
    const auto along = static_cast<std::size_t>(axis);
    range.first[along] = static_cast<std::int32_t>(band) * height;
    range.last[along] = std::min(range.first[along] + height, grid.size[along]) - 1;
    return range;
  }
};

// Whether the groups of a block reach into the grid. `low_high` are their boxes in LPS.
struct GridBox {
  Affine index;
  Eigen::Matrix3d reach;  // |linear|
  Eigen::Vector3d last;

  explicit GridBox(const ImageGrid& grid)
      : index(to_index(grid)),
        reach(index.linear.cwiseAbs()),
        last(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1) {}

  bool meets(const TetBlocks& blocks, std::size_t b, std::span<const float> low_high) const {
    std::array<float, 6> box = box_around(blocks.groups_of(b), low_high);
    const Eigen::Map<const Eigen::Vector3f> low(box.data()), high(box.data() + 3);
    if (!low.allFinite() || !high.allFinite()) return true;
    const Eigen::Vector3d middle = index * Eigen::Vector3d((0.5F * (low + high)).cast<double>());
    const Eigen::Vector3d half = reach * Eigen::Vector3d((0.5F * (high - low)).cast<double>());
    constexpr double rounding = 1e-2;  // of float32 metres away, in voxels of a tenth of a millimetre
    return ((middle + half).array() >= -rounding).all() &&
           ((middle - half).array() <= last.array() + rounding).all();
  }

 private:
  static std::array<float, 6> box_around(std::span<const std::uint32_t> groups,
                                         std::span<const float> low_high) {
    std::array<float, 6> box;
    std::copy_n(&low_high[6 * std::size_t{groups[0]}], 6, box.begin());
    for (const std::uint32_t g : groups) {
      for (std::size_t c = 0; c < 3; ++c) {
        box[c] = std::min(box[c], low_high[6 * std::size_t{g} + c]);
        box[c + 3] = std::max(box[c + 3], low_high[6 * std::size_t{g} + c + 3]);
      }
    }
    return box;
  }
};

bool one_lattice(const ImageGrid& a, const ImageGrid& b) {
  return a.spacing == b.spacing && a.direction == b.direction;
}

// Every task its own part of the output, whole rows.
void fill_band(const SampleJob& job, const VoxelRange& range) {
  with_scalar_type(job.posed.type, [&](auto zero) {
    using T = decltype(zero);
    const std::span<T> posed = job.posed.scalars<T>();
    const auto components = static_cast<std::size_t>(job.posed.components);
    const ImageGrid& grid = job.posed.grid;
    const T background = to_scalar<T>(job.background);
    for (std::int32_t k = range.first[2]; k <= range.last[2]; ++k) {
      const std::size_t first = grid.offset(0, range.first[1], k);
      const std::size_t end = grid.offset(0, range.last[1], k) + static_cast<std::size_t>(grid.size[0]);
      std::fill(posed.begin() + static_cast<std::ptrdiff_t>(components * first),
                posed.begin() + static_cast<std::ptrdiff_t>(components * end), background);
    }
  });
}

}  // namespace

VolumePoser::VolumePoser(std::shared_ptr<const Model> model) : model_(std::move(model)), blocks_(*model_) {}

void VolumePoser::pose(std::span<const float> nodes, const ModelVolume& volume, Sampling sampling,
                       const ImageGrid& grid, Image& out, Scratch& scratch, const Context& context) const {
  const double voxels = static_cast<double>(grid.size[0]) * grid.size[1] * grid.size[2];
  if (!(voxels > 0 && voxels <= kMostVoxels)) {
    throw Error(ErrorKind::data, "posed volume", "a grid of " + std::to_string(voxels) + " voxels",
                "ask for at least one voxel and at most 2^31");
  }
  if (!(out.grid == grid && out.type == volume.image.type && out.components == volume.image.components)) {
    out = Image(grid, volume.image.type, volume.image.components);
  }

  scratch.bounds.resize(6 * blocks_.groups());
  blocks_.bound_groups(nodes, scratch.bounds);
  const std::span<const float> rest_nodes(model_->nodes.data(),
                                          static_cast<std::size_t>(model_->nodes.size()));
  std::array<float, 6> rest_box;
  for (int c = 0; c < 3; ++c) {
    rest_box[static_cast<std::size_t>(c)] = model_->nodes.col(c).minCoeff();
    rest_box[static_cast<std::size_t>(c) + 3] = model_->nodes.col(c).maxCoeff();
  }
  const int bits = fraction_bits(
      std::max(index_reach(grid, box_of(scratch.bounds)), index_reach(volume.image.grid, rest_box)));
  scratch.posed.resize(nodes.size());
  scratch.rest.resize(nodes.size());
  to_fixed(grid, bits, nodes, scratch.posed);
  to_fixed(volume.image.grid, bits, rest_nodes, scratch.rest);
  context.check_stop();

  const DrawTets job{model_->tets,
                     scratch.posed,
                     scratch.rest,
                     bits,
                     one_lattice(grid, volume.image.grid),
                     to_index(grid).linear.determinant() < 0,
                     grid.size};
  const Bands bands(grid);
  const VoxelRange whole{{}, {grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1}};

  // The blocks that reach into the grid, and the bands of each of their tets.
  const GridBox grid_box(grid);
  const std::size_t tets = model_->tet_count(), all = blocks_.blocks();
  scratch.extents.resize(tets);
  scratch.block_first.resize(all);
  scratch.block_last.resize(all);
  const std::size_t tasks = (all + kBlocksPerTask - 1) / kBlocksPerTask;
  scratch.inverted.resize(tets);
  scratch.blocks.assign(tasks, 0);  // inverted tets of each task
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    if (context.stop.stop_requested()) return;
    const std::size_t task_first = task * kBlocksPerTask * TetBlocks::size;
    for (std::size_t b = task * kBlocksPerTask; b < std::min(all, (task + 1) * kBlocksPerTask); ++b) {
      std::uint16_t& first = scratch.block_first[b] = TetExtent::none;
      std::uint16_t& last = scratch.block_last[b] = 0;
      if (!grid_box.meets(blocks_, b, scratch.bounds)) continue;
      const std::size_t begin = b * TetBlocks::size, end = std::min(tets, begin + TetBlocks::size);
      const std::span<TetExtent> extents = std::span(scratch.extents).subspan(begin, end - begin);
      scratch.blocks[task] += static_cast<std::uint32_t>(
          kernels::classify_tets(job, whole, bands.axis, bands.height, begin, end, extents,
                                 std::span(scratch.inverted).subspan(task_first + scratch.blocks[task])));
      for (const TetExtent& extent : extents) {
        if (extent.first > extent.last) continue;
        first = std::min(first, extent.first);
        last = std::max(last, extent.last);
      }
    }
  });
  context.check_stop();
  std::size_t inverted = 0;
  for (std::size_t task = 0; task < tasks; ++task) {
    const auto from =
        scratch.inverted.begin() + static_cast<std::ptrdiff_t>(task * kBlocksPerTask * TetBlocks::size);
    std::copy_n(from, scratch.blocks[task], scratch.inverted.begin() + static_cast<std::ptrdiff_t>(inverted));
    inverted += scratch.blocks[task];
  }
  std::reverse(scratch.inverted.begin(), scratch.inverted.begin() + static_cast<std::ptrdiff_t>(inverted));

  // From the least to the greatest claim on a voxel, each writing over the last.
  const SampleJob samples{volume.image, volume.background, out};
  const BatchSink sink = sink_for(samples, volume.labels ? Sampling::nearest : sampling);
  tbb::parallel_for(std::size_t{0}, bands.count, [&](std::size_t band) {
    if (context.stop.stop_requested()) return;
    const VoxelRange range = bands.of(band, grid);
    fill_band(samples, range);
    VoxelBatch batch;
    kernels::draw_tets(job, range, std::span<const std::uint32_t>(scratch.inverted).first(inverted), batch,
                       sink);
    std::array<std::uint32_t, TetBlocks::size> ids;
    for (std::size_t b = all; b-- > 0;) {
      if (band < scratch.block_first[b] || band > scratch.block_last[b]) continue;
      std::size_t count = 0;
      for (std::size_t t = std::min(tets, (b + 1) * TetBlocks::size); t-- > b * TetBlocks::size;) {
        const TetExtent& extent = scratch.extents[t];
        if (band >= extent.first && band <= extent.last) ids[count++] = static_cast<std::uint32_t>(t);
      }
      kernels::draw_tets(job, range, std::span<const std::uint32_t>(ids).first(count), batch, sink);
    }
    if (batch.count > 0) sink.sample(sink.to, batch);
  });
  context.check_stop();
}

Image pose_volume(std::shared_ptr<const Model> model, std::span<const float> nodes, const ModelVolume& volume,
                  Sampling sampling, const ImageGrid& grid, const Context& context) {
  Image out;
  VolumePoser::Scratch scratch;
  VolumePoser(std::move(model)).pose(nodes, volume, sampling, grid, out, scratch, context);
  return out;
}

}  // namespace ecorche::runtime
