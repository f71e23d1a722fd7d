// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/volume_poser.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
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

// Every task its own part of the output, whole rows or those of the mask's bricks.
void fill_band(const SampleJob& job, const BrickMask& only, const VoxelRange& range) {
  with_scalar_type(job.posed.type, [&](auto zero) {
    using T = decltype(zero);
    const std::span<T> posed = job.posed.scalars<T>();
    const auto components = static_cast<std::size_t>(job.posed.components);
    const ImageGrid& grid = job.posed.grid;
    const T background = to_scalar<T>(job.background);
    const auto fill = [&](std::size_t first, std::size_t end) {
      std::fill(posed.begin() + static_cast<std::ptrdiff_t>(components * first),
                posed.begin() + static_cast<std::ptrdiff_t>(components * end), background);
    };
    for (std::int32_t k = range.first[2]; k <= range.last[2]; ++k) {
      if (!only) {
        fill(grid.offset(0, range.first[1], k),
             grid.offset(0, range.last[1], k) + static_cast<std::size_t>(grid.size[0]));
        continue;
      }
      for (std::int32_t j = range.first[1]; j <= range.last[1]; ++j) {
        for (std::int32_t i = 0; i < grid.size[0]; i += Bricks::edge) {
          if (only.has(i, j, k))
            fill(grid.offset(i, j, k),
                 grid.offset(0, j, k) + static_cast<std::size_t>(std::min(i + Bricks::edge, grid.size[0])));
        }
      }
    }
  });
}

VoxelRange whole(const ImageGrid& grid) {
  return {{}, {grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1}};
}

void check_grid(const ImageGrid& grid) {
  const double voxels = static_cast<double>(grid.size[0]) * grid.size[1] * grid.size[2];
  if (voxels > 0 && voxels <= kMostVoxels) return;
  throw Error(ErrorKind::data, "posed volume", "a grid of " + std::to_string(voxels) + " voxels",
              "ask for at least one voxel and at most 2^31");
}

// Made anew where it is another one.
void fit_image(const ImageGrid& grid, const ModelVolume& volume, Image& out) {
  if (!(out.grid == grid && out.type == volume.image.type && out.components == volume.image.components))
    out = Image(grid, volume.image.type, volume.image.components);
}

}  // namespace

struct VolumePoser::Job {
  std::span<const float> nodes;
  const ModelVolume& volume;
  Sampling sampling;
  const ImageGrid& grid;
  bool all_nodes;  // in fixed points, also of tets that lie beyond the grid
  const Context& context;
};

VolumePoser::VolumePoser(std::shared_ptr<const Model> model) : model_(std::move(model)), blocks_(*model_) {
  if (model_->node_count() == 0) return;
  for (int c = 0; c < 3; ++c) {
    rest_box_[static_cast<std::size_t>(c)] = model_->nodes.col(c).minCoeff();
    rest_box_[static_cast<std::size_t>(c) + 3] = model_->nodes.col(c).maxCoeff();
  }
}

const TetPalettes& VolumePoser::palettes() const {
  std::call_once(palettes_made_, [&] {
    // A thread that waits here must not begin another volume of this poser: it would wait for itself.
    tbb::this_task_arena::isolate([&] {
      palettes_ = std::make_unique<const TetPalettes>(model_->tets, std::span<const std::uint32_t>(), 3);
    });
  });
  return *palettes_;
}

// Which blocks reach into the grid, and their nodes in fixed points.
DrawTets VolumePoser::prepare(const Job& job, Scratch& scratch) const {
  const ImageGrid& rest_grid = job.volume.image.grid;
  scratch.bounds.resize(6 * blocks_.groups());
  blocks_.bound_groups(job.nodes, scratch.bounds);
  const int bits = fraction_bits(
      std::max(index_reach(job.grid, box_of(scratch.bounds)), index_reach(rest_grid, rest_box_)));

  const GridBox grid_box(job.grid);
  scratch.block_meets.resize(blocks_.blocks());
  scratch.groups.assign(blocks_.groups(), job.all_nodes ? 1 : 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks_.blocks(), 512), [&](const auto& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b) {
      const bool meets = grid_box.meets(blocks_, b, scratch.bounds);
      scratch.block_meets[b] = meets ? 1 : 0;
      for (std::size_t i = 0; meets && !job.all_nodes && i < blocks_.groups_of(b).size(); ++i) {
        // Everybody writes the same 1.
        std::atomic_ref(scratch.groups[blocks_.groups_of(b)[i]]).store(1, std::memory_order_relaxed);
      }
    }
  });
  scratch.posed.resize(job.nodes.size() + 1);
  to_fixed(job.grid, bits, job.nodes, scratch.groups, scratch.posed);
  if (scratch.of_rest.model != model_.get() || scratch.of_rest.bits != bits ||
      !(scratch.of_rest.grid == rest_grid)) {
    scratch.rest.resize(job.nodes.size() + 1);
    to_fixed(rest_grid, bits, {model_->nodes.data(), static_cast<std::size_t>(model_->nodes.size())},
             scratch.rest);
    scratch.of_rest = {model_.get(), rest_grid, bits};
  }
  job.context.check_stop();
  return {model_->tets,
          palettes(),
          scratch.posed,
          scratch.rest,
          bits,
          one_lattice(job.grid, rest_grid),
          to_index(job.grid).linear.determinant() < 0,
          job.grid.size,
          {}};
}

void VolumePoser::pose(std::span<const float> nodes, const ModelVolume& volume, Sampling sampling,
                       const ImageGrid& grid, Image& out, Scratch& scratch, const Context& context) const {
  check_grid(grid);
  fit_image(grid, volume, out);
  const Job job{nodes, volume, sampling, grid, false, context};
  draw(job, prepare(job, scratch), out, scratch);
}

void VolumePoser::follow(std::span<const float> nodes, const ModelVolume& volume, Sampling sampling,
                         const ImageGrid& grid, PosedVolume& kept, Scratch& scratch,
                         const Context& context) const {
  check_grid(grid);
  const bool same = kept.drawn.volume == &volume && kept.drawn.sampling == sampling &&
                    kept.image.grid == grid && kept.drawn.posed.size() == nodes.size() + 1;
  kept.drawn.volume = nullptr;
  fit_image(grid, volume, kept.image);
  const Job job{nodes, volume, sampling, grid, true, context};
  DrawTets tets = prepare(job, scratch);
  kept.bricks = Bricks(grid);
  kept.moved.assign(kept.bricks.all(), same && kept.drawn.bits == tets.bits ? 0 : 1);
  if (same && kept.drawn.bits == tets.bits) {
    find_moved(job, tets, kept, scratch);
    tets.only = {kept.bricks, kept.moved.data()};
  }
  kept.rewritten.clear();
  kept.rewritten.reserve(kept.bricks.all());
  for (std::size_t b = 0; b < kept.moved.size(); ++b) {
    if (kept.moved[b] != 0) kept.rewritten.push_back(static_cast<std::uint32_t>(b));
  }
  if (!kept.rewritten.empty()) draw(job, tets, kept.image, scratch);
  kept.drawn.posed.resize(nodes.size() + 1);
  std::swap(kept.drawn.posed, scratch.posed);
  kept.drawn.bits = tets.bits;
  kept.drawn.sampling = sampling;
  kept.drawn.volume = &volume;
}

void VolumePoser::find_moved(const Job& job, const DrawTets& tets, PosedVolume& kept,
                             Scratch& scratch) const {
  const std::span<const std::int32_t> before = kept.drawn.posed;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks_.groups(), 256), [&](const auto& range) {
    for (std::size_t g = range.begin(); g < range.end(); ++g) {
      const std::size_t first = 3 * TetBlocks::size * g;
      const std::size_t end = std::min(before.size(), first + 3 * TetBlocks::size);
      scratch.groups[g] = std::equal(before.begin() + static_cast<std::ptrdiff_t>(first),
                                     before.begin() + static_cast<std::ptrdiff_t>(end),
                                     scratch.posed.begin() + static_cast<std::ptrdiff_t>(first))
                              ? 0
                              : 1;
    }
  });
  const VoxelRange range = whole(job.grid);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks_.blocks(), 64), [&](const auto& blocks) {
    for (std::size_t b = blocks.begin(); b < blocks.end(); ++b) {
      const std::span<const std::uint32_t> groups = blocks_.groups_of(b);
      if (std::none_of(groups.begin(), groups.end(), [&](std::uint32_t g) { return scratch.groups[g] != 0; }))
        continue;
      kernels::mark_moved(tets, before, range, kept.bricks, b * TetBlocks::size,
                          std::min(model_->tet_count(), (b + 1) * TetBlocks::size), kept.moved.data());
    }
  });
  job.context.check_stop();
}

void VolumePoser::draw(const Job& job, const DrawTets& drawn, Image& out, Scratch& scratch) const {
  const ImageGrid& grid = job.grid;
  const Context& context = job.context;
  const Bands bands(grid);

  // The blocks that reach into the grid, and the bands of each of their tets.
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
      if (scratch.block_meets[b] == 0) continue;
      const std::size_t begin = b * TetBlocks::size, end = std::min(tets, begin + TetBlocks::size);
      const std::span<TetExtent> extents = std::span(scratch.extents).subspan(begin, end - begin);
      scratch.blocks[task] += static_cast<std::uint32_t>(
          kernels::classify_tets(drawn, whole(grid), bands.axis, bands.height, begin, end, extents,
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
  const SampleJob samples{job.volume.image, job.volume.background, out};
  const BatchSink sink = sink_for(samples, job.volume.labels ? Sampling::nearest : job.sampling);
  tbb::parallel_for(std::size_t{0}, bands.count, [&](std::size_t number) {
    const auto band = static_cast<std::uint16_t>(number);
    if (context.stop.stop_requested()) return;
    const VoxelRange range = bands.of(band, grid);
    fill_band(samples, drawn.only, range);
    VoxelBatch batch;
    kernels::draw_tets(drawn, range, std::span<const std::uint32_t>(scratch.inverted).first(inverted), batch,
                       sink);
    std::array<std::uint8_t, TetBlocks::size> wanted{};
    for (std::size_t b = all; b-- > 0;) {
      if (band < scratch.block_first[b] || band > scratch.block_last[b]) continue;
      const std::size_t count = std::min(TetBlocks::size, tets - b * TetBlocks::size);
      const TetExtent* extents = &scratch.extents[b * TetBlocks::size];
      for (std::size_t i = 0; i < count; ++i)
        wanted[i] = static_cast<std::uint8_t>(band >= extents[i].first) &
                    static_cast<std::uint8_t>(band <= extents[i].last);
      std::fill(wanted.begin() + static_cast<std::ptrdiff_t>(count), wanted.end(), std::uint8_t{0});
      kernels::draw_runs(drawn, range, b * TetBlocks::size / TetPalettes::width, wanted, batch, sink);
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
