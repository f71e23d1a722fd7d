// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/refill.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include <ecorche/values/error.hpp>
#include "runtime/spheres/lookup.hpp"
#include "runtime/spheres/place_batch.hpp"

namespace ecorche::runtime {
namespace {

template <class T>
void clear(T value, std::size_t components, const BrickMask& mask, Image& out) {
  const std::span<T> posed = out.scalars<T>();
  const auto& size = out.grid.size;
  tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, size[2]), [&](const auto& slices) {
    for (std::int32_t k = slices.begin(); k < slices.end(); ++k) {
      for (std::int32_t j = 0; j < size[1]; ++j) {
        for (std::int32_t i = 0; i < size[0]; i += Bricks::edge) {
          if (mask && !mask.has(i, j, k)) continue;
          const auto run = static_cast<std::size_t>(std::min(Bricks::edge, size[0] - i));
          std::fill_n(&posed[components * out.grid.offset(i, j, k)], components * run, value);
        }
      }
    }
  });
}

template <class T>
void fill(const BallSet& set, const LatticeBox& box, const Image& volume, double background, bool nearest,
          const BrickMask& mask, Image& out, const Context& context) {
  const auto components = static_cast<std::size_t>(volume.components);
  clear(to_scalar<T>(background), components, mask, out);
  const std::span<T> posed = out.scalars<T>();
  const ToVolume to_volume(set.lattice, volume.grid);
  // Calls f(voxel's offset, index of the volume) for every voxel that a ball owns.
  const auto each = [&](const Tile& tile, auto&& f) {
    tile.for_owned([&](std::int32_t i, std::int32_t j, std::int32_t k, std::int32_t owner) {
      const Ball& ball = set.balls[static_cast<std::size_t>(owner)];
      const Vec3& c = ball.centre;
      f(out.grid.offset(i, j, k), to_volume(rest_place(set, ball, box.first[0] + i - c[0],
                                                       box.first[1] + j - c[1], box.first[2] + k - c[2])));
    });
  };
  if (nearest) {
    const Sampler<T> sampler{volume.grid, volume.scalars<T>(), components, background};
    for_tiles(
        set, box, context,
        [&](const Tile& tile) {
          each(tile, [&](std::size_t offset, const Vec3& at) {
            sampler.nearest(at[0], at[1], at[2], &posed[components * offset]);
          });
        },
        mask);
    return;
  }
  const SampleJob job{volume, background, out};
  tbb::enumerable_thread_specific<PlaceBatch> batches(sink_for(job, Sampling::trilinear));
  for_tiles(
      set, box, context,
      [&](const Tile& tile) {
        PlaceBatch& batch = batches.local();
        each(tile, [&](std::size_t offset, const Vec3& at) { batch.add(offset, at); });
      },
      mask);
  for (PlaceBatch& batch : batches) batch.flush();
}

}  // namespace

void refill_bricks(const BallSet& set, const LatticeBox& box, const Image& volume, double background,
                   Sampling sampling, const BrickMask& mask, Image& out, const Context& context) {
  if (out.grid.size != box.size || out.type != volume.type || out.components != volume.components) {
    throw Error(ErrorKind::internal, "refill", "the result is no image of the box", "this is a bug");
  }
  with_scalar_type(volume.type, [&](auto zero) {
    fill<decltype(zero)>(set, box, volume, background, sampling == Sampling::nearest, mask, out, context);
  });
}

void refill_into(const BallSet& set, const LatticeBox& box, const Image& volume, double background,
                 Sampling sampling, Image& out, const Context& context) {
  refill_bricks(set, box, volume, background, sampling, {}, out, context);
}

Image refill(const BallSet& set, const LatticeBox& box, const Image& volume, double background,
             Sampling sampling, const Context& context) {
  Image out(grid_of(set.lattice, box), volume.type, volume.components);
  refill_into(set, box, volume, background, sampling, out, context);
  return out;
}

}  // namespace ecorche::runtime
