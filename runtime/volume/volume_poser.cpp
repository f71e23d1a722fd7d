// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/volume_poser.hpp>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>

#include <ecorche/runtime/rigid_copies.hpp>
#include "runtime/volume/draw_tets.hpp"
#include "runtime/volume/fixed_points.hpp"
#include "runtime/volume/grid_affine.hpp"
#include "runtime/volume/grid_bands.hpp"
#include "runtime/volume/grid_reach.hpp"
#include "runtime/volume/sample_batch.hpp"
#include "runtime/volume/sampler.hpp"
#include "runtime/volume/tet_blocks.hpp"
#include "runtime/volume/tet_palettes.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kRunsPerBlock = TetBlocks::size / TetPalettes::width;
constexpr std::size_t kStretch = 32;  // runs that are looked at together
constexpr double kMostVoxels = 2147483648.0;

bool one_lattice(const ImageGrid& a, const ImageGrid& b) {
  return a.spacing == b.spacing && a.direction == b.direction;
}

// The background into `range`, or those of its voxels that lie in the mask's bricks.
void fill(const SampleJob& job, const BrickMask& only, const VoxelRange& range) {
  with_scalar_type(job.posed.type, [&](auto zero) {
    using T = decltype(zero);
    const std::span<T> posed = job.posed.scalars<T>();
    const auto components = static_cast<std::size_t>(job.posed.components);
    const ImageGrid& grid = job.posed.grid;
    const T background = to_scalar<T>(job.background);
    const auto fill_row = [&](std::int32_t first, std::int32_t last, std::int32_t j, std::int32_t k) {
      std::fill_n(posed.begin() + static_cast<std::ptrdiff_t>(components * grid.offset(first, j, k)),
                  components * static_cast<std::size_t>(last - first + 1), background);
    };
    for (std::int32_t k = range.first[2]; k <= range.last[2]; ++k) {
      for (std::int32_t j = range.first[1]; j <= range.last[1]; ++j) {
        if (!only) {
          fill_row(range.first[0], range.last[0], j, k);
          continue;
        }
        for (std::int32_t i = range.first[0]; i <= range.last[0];) {
          const std::int32_t last = std::min((i / Bricks::edge + 1) * Bricks::edge - 1, range.last[0]);
          if (only.has(i, j, k)) fill_row(i, last, j, k);
          i = last + 1;
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

// How one volume is asked for.
struct Job {
  std::span<const float> nodes;
  const ModelVolume& volume;
  Sampling sampling;
  const ImageGrid& grid;
  bool all_nodes;  // in fixed points, also of tets that lie beyond the grid
  const Context& context;
};

}  // namespace

struct VolumePoser::Impl {
  std::shared_ptr<const Model> model;
  RigidCopies copies{*model};
  DrawnTets drawn{model->tets, copies, static_cast<std::int32_t>(base())};
  TetBlocks blocks{drawn, copies.nodes() == 0 ? model->node_count() : base() + copies.nodes(),
                   copies.nodes()};
  std::array<float, 6> rest_box{};
  mutable std::once_flag palettes_made;  // with the first volume: many a poser never poses one
  mutable std::unique_ptr<const TetPalettes> made_palettes;

  explicit Impl(std::shared_ptr<const Model> of) : model(std::move(of)) {
    if (model->node_count() == 0) return;
    for (int c = 0; c < 3; ++c) {
      rest_box[static_cast<std::size_t>(c)] = model->nodes.col(c).minCoeff();
      rest_box[static_cast<std::size_t>(c) + 3] = model->nodes.col(c).maxCoeff();
    }
  }

  // Of the copied nodes, a multiple of TetBlocks::size.
  std::size_t base() const {
    return (model->node_count() + TetBlocks::size - 1) / TetBlocks::size * TetBlocks::size;
  }
  const TetPalettes& palettes() const;
  DrawTets prepare(const Job& job, Scratch& scratch) const;
  void find_moved(const Job& job, const DrawTets& tets, PosedVolume& kept, Scratch& scratch) const;
};

VolumePoser::VolumePoser(std::shared_ptr<const Model> model)
    : impl_(std::make_unique<const Impl>(std::move(model))) {}

VolumePoser::~VolumePoser() = default;

const Model& VolumePoser::model() const {
  return *impl_->model;
}

HeldArrays VolumePoser::arrays() const {
  HeldArrays out;
  impl_->copies.add_arrays(out);
  impl_->blocks.add_arrays(out);
  impl_->palettes().add_arrays(out);
  return out;
}

const TetPalettes& VolumePoser::Impl::palettes() const {
  std::call_once(palettes_made, [&] {
    // A thread that waits here must not begin another volume of this poser: it would wait for itself.
    tbb::this_task_arena::isolate([&] {
      made_palettes = std::make_unique<const TetPalettes>(drawn, std::span<const std::uint32_t>(), 3);
    });
  });
  return *made_palettes;
}

// Which blocks reach into the grid, and their nodes in fixed points.
DrawTets VolumePoser::Impl::prepare(const Job& job, Scratch& scratch) const {
  const ImageGrid& rest_grid = job.volume.image.grid;
  scratch.bounds.resize(6 * blocks.groups());
  scratch.copied.resize(3 * copies.nodes());
  copies.place(job.nodes, scratch.copied);
  blocks.bound_groups(job.nodes, scratch.copied, scratch.bounds);
  const int bits = fraction_bits(
      std::max(index_reach(job.grid, box_of(scratch.bounds)), index_reach(rest_grid, rest_box)));

  const GridReach grid_box(job.grid);
  scratch.sides.resize(blocks.groups());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.groups(), 512), [&](const auto& range) {
    for (std::size_t g = range.begin(); g < range.end(); ++g)
      scratch.sides[g] = grid_box.sides(std::span<const float, 6>(&scratch.bounds[6 * g], 6));
  });
  scratch.block_meets.resize(blocks.blocks());
  scratch.groups.assign(blocks.groups(), job.all_nodes ? 1 : 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.blocks(), 1024), [&](const auto& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b) {
      const std::span<const std::uint32_t> groups = blocks.groups_of(b);
      std::uint8_t sides = 0;
      for (const std::uint32_t g : groups) sides |= scratch.sides[g];
      const bool meets = sides == GridReach::reaches;
      scratch.block_meets[b] = meets ? 1 : 0;
      if (!meets || job.all_nodes) continue;
      for (const std::uint32_t g : groups) {
        // Everybody writes the same 1.
        std::atomic_ref(scratch.groups[g]).store(1, std::memory_order_relaxed);
      }
    }
  });
  // Copied nodes come last, from a group of their own on.
  const std::size_t numbers = copies.nodes() == 0 ? job.nodes.size() : 3 * (base() + copies.nodes());
  scratch.posed.resize(numbers + 1);
  to_fixed(job.grid, bits, job.nodes, scratch.groups, scratch.posed);
  to_fixed(job.grid, bits, scratch.copied, std::span(scratch.posed).subspan(numbers - scratch.copied.size()));
  if (scratch.of_rest.model != model.get() || scratch.of_rest.bits != bits ||
      !(scratch.of_rest.grid == rest_grid)) {
    scratch.rest.resize(numbers + 1);
    to_fixed(rest_grid, bits, {model->nodes.data(), static_cast<std::size_t>(model->nodes.size())},
             scratch.rest);
    to_fixed(rest_grid, bits, copies.rest(), std::span(scratch.rest).subspan(numbers - copies.rest().size()));
    scratch.of_rest = {model.get(), rest_grid, bits};
  }
  job.context.check_stop();
  return {drawn,
          palettes(),
          scratch.posed,
          scratch.rest,
          bits,
          one_lattice(job.grid, rest_grid),
          to_index(job.grid).linear.determinant() < 0,
          job.grid.size,
          {}};
}

void VolumePoser::Impl::find_moved(const Job& job, const DrawTets& tets, PosedVolume& kept,
                                   Scratch& scratch) const {
  const std::span<const std::int32_t> before = kept.drawn.posed;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.groups(), 256), [&](const auto& range) {
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
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.blocks(), 64), [&](const auto& some) {
    for (std::size_t b = some.begin(); b < some.end(); ++b) {
      const std::span<const std::uint32_t> groups = blocks.groups_of(b);
      if (std::none_of(groups.begin(), groups.end(), [&](std::uint32_t g) { return scratch.groups[g] != 0; }))
        continue;
      kernels::mark_moved(tets, before, range, kept.bricks, b * TetBlocks::size,
                          std::min(static_cast<std::size_t>(drawn.rows()), (b + 1) * TetBlocks::size),
                          kept.moved.data());
    }
  });
  job.context.check_stop();
}

namespace {

// One band on its way into the output.
class Band {
 public:
  Band(const DrawTets& tets, const SampleJob& samples, const BatchSink& sink,
       const VolumePoser::Scratch& scratch)
      : tets_(tets), samples_(samples), sink_(sink), scratch_(scratch) {}

  // From the least to the greatest claim on a voxel, each writing over the last: inverted tets, then positive
  // ones. The former are few, and found on the way: what they may hold is then drawn again, with them.
  void draw(const VoxelRange& range) {
    fill(samples_, tets_.only, range);
    Inverted inverted, none;
    put(range, Claim::positive, inverted);
    for (std::size_t b = 0; b < inverted.count; ++b) {
      const VoxelRange& again = inverted.box[b];
      put(again, Claim::inverted, none);
      put(again, Claim::positive, none);
    }
  }

 private:
  // Runs from the last to the first.
  void put(const VoxelRange& range, Claim claim, Inverted& found) {
    std::array<std::uint32_t, 256> runs;
    std::size_t count = 0;
    const auto put_runs = [&] {
      kernels::draw_runs(tets_, range, std::span(runs).first(count), claim, batch_, sink_, found);
      count = 0;
    };
    for (std::size_t stretch = scratch_.stretches.size(); stretch-- > 0;) {
      if (!scratch_.stretches[stretch].meets(range)) continue;
      const std::size_t first = stretch * kStretch;
      for (std::size_t r = std::min(scratch_.runs.size(), first + kStretch); r-- > first;) {
        runs[count] = static_cast<std::uint32_t>(r);
        count += scratch_.runs[r].meets(range) ? 1 : 0;
        if (count == runs.size()) put_runs();
      }
    }
    put_runs();
    if (batch_.count > 0) sink_.sample(sink_.to, batch_);
    batch_.count = 0;
  }

  const DrawTets& tets_;
  const SampleJob& samples_;
  const BatchSink& sink_;
  const VolumePoser::Scratch& scratch_;
  VoxelBatch batch_;
};

void draw(const Job& job, const DrawTets& drawn, Image& out, VolumePoser::Scratch& scratch) {
  const ImageGrid& grid = job.grid;
  const Context& context = job.context;
  const GridBands bands(grid);

  // Where the runs of the blocks that reach into the grid lie.
  scratch.runs.resize(drawn.palettes.runs());
  scratch.stretches.resize((scratch.runs.size() + kStretch - 1) / kStretch);
  const VoxelRange all = whole(grid);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, scratch.stretches.size(), 16), [&](const auto& some) {
    if (context.stop.stop_requested()) return;
    for (std::size_t s = some.begin(); s < some.end(); ++s) {
      VoxelRange& stretch = scratch.stretches[s] = VoxelRange::nothing();
      const std::size_t end = std::min(scratch.runs.size(), (s + 1) * kStretch);
      for (std::size_t r = s * kStretch; r < end; r += kRunsPerBlock) {
        const std::span<VoxelRange> runs =
            std::span(scratch.runs).subspan(r, std::min(end - r, kRunsPerBlock));
        if (scratch.block_meets[r / kRunsPerBlock] != 0) {
          kernels::box_runs(drawn, all, r, runs);
        } else {
          std::fill(runs.begin(), runs.end(), VoxelRange::nothing());
        }
        for (const VoxelRange& run : runs) stretch = stretch.around(run);
      }
    }
  });
  context.check_stop();

  const SampleJob samples{job.volume.image, job.volume.background, out};
  const BatchSink sink = sink_for(samples, job.volume.labels ? Sampling::nearest : job.sampling);
  tbb::parallel_for(std::size_t{0}, bands.count(), [&](std::size_t number) {
    if (context.stop.stop_requested()) return;
    Band(drawn, samples, sink, scratch).draw(bands.of(number, grid));
  });
  context.check_stop();
}

}  // namespace

void VolumePoser::pose(std::span<const float> nodes, const ModelVolume& volume, Sampling sampling,
                       const ImageGrid& grid, Image& out, Scratch& scratch, const Context& context) const {
  check_grid(grid);
  fit_image(grid, volume, out);
  const Job job{nodes, volume, sampling, grid, false, context};
  draw(job, impl_->prepare(job, scratch), out, scratch);
}

void VolumePoser::follow(std::span<const float> nodes, const ModelVolume& volume, Sampling sampling,
                         const ImageGrid& grid, PosedVolume& kept, Scratch& scratch,
                         const Context& context) const {
  check_grid(grid);
  const bool same = kept.drawn.volume == &volume && kept.drawn.sampling == sampling &&
                    kept.image.grid == grid && kept.drawn.nodes == nodes.size();
  kept.drawn.volume = nullptr;
  fit_image(grid, volume, kept.image);
  const Job job{nodes, volume, sampling, grid, true, context};
  DrawTets tets = impl_->prepare(job, scratch);
  kept.bricks = Bricks(grid);
  kept.moved.assign(kept.bricks.all(), same && kept.drawn.bits == tets.bits ? 0 : 1);
  if (same && kept.drawn.bits == tets.bits) {
    impl_->find_moved(job, tets, kept, scratch);
    tets.only = {kept.bricks, kept.moved.data()};
  }
  kept.rewritten.clear();
  kept.rewritten.reserve(kept.bricks.all());
  for (std::size_t b = 0; b < kept.moved.size(); ++b) {
    if (kept.moved[b] != 0) kept.rewritten.push_back(static_cast<std::uint32_t>(b));
  }
  if (!kept.rewritten.empty()) draw(job, tets, kept.image, scratch);
  kept.drawn.posed.resize(scratch.posed.size());
  std::swap(kept.drawn.posed, scratch.posed);
  kept.drawn.nodes = nodes.size();
  kept.drawn.bits = tets.bits;
  kept.drawn.sampling = sampling;
  kept.drawn.volume = &volume;
}

Image pose_volume(std::shared_ptr<const Model> model, std::span<const float> nodes, const ModelVolume& volume,
                  Sampling sampling, const ImageGrid& grid, const Context& context) {
  Image out;
  VolumePoser::Scratch scratch;
  VolumePoser(std::move(model)).pose(nodes, volume, sampling, grid, out, scratch, context);
  return out;
}

}  // namespace ecorche::runtime
