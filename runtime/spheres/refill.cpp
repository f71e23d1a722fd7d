// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/refill.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/values/error.hpp"
#include "runtime/spheres/lookup.hpp"
#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {
namespace {

template <class T>
void fill(const BallSet& set, const LatticeBox& box, const Image& volume, double background, bool nearest,
          Image& out, const Context& context) {
  const std::span<T> posed = out.scalars<T>();
  const auto components = static_cast<std::size_t>(volume.components);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, posed.size(), 1 << 18), [&](const auto& range) {
    std::fill(posed.begin() + static_cast<std::ptrdiff_t>(range.begin()),
              posed.begin() + static_cast<std::ptrdiff_t>(range.end()), to_scalar<T>(background));
  });
  const Sampler<T> sampler{volume.grid, volume.scalars<T>(), components, background};
  const ToVolume to_volume(set.lattice, volume.grid);
  for_tiles(set, box, context, [&](const Tile& tile) {
    tile.for_owned([&](std::int32_t i, std::int32_t j, std::int32_t k, std::int32_t owner) {
      const Ball& ball = set.balls[static_cast<std::size_t>(owner)];
      const Vec3& c = ball.centre;
      const Vec3 at = to_volume(
          rest_place(set, ball, box.first[0] + i - c[0], box.first[1] + j - c[1], box.first[2] + k - c[2]));
      T* voxel = &posed[components * out.grid.offset(i, j, k)];
      nearest ? sampler.nearest(at[0], at[1], at[2], voxel) : sampler.trilinear(at[0], at[1], at[2], voxel);
    });
  });
}

}  // namespace

void refill_into(const BallSet& set, const LatticeBox& box, const Image& volume, double background,
                 Sampling sampling, Image& out, const Context& context) {
  if (out.grid.size != box.size || out.type != volume.type || out.components != volume.components) {
    throw Error(ErrorKind::internal, "refill", "the result is no image of the box", "this is a bug");
  }
  with_scalar_type(volume.type, [&](auto zero) {
    fill<decltype(zero)>(set, box, volume, background, sampling == Sampling::nearest, out, context);
  });
}

Image refill(const BallSet& set, const LatticeBox& box, const Image& volume, double background,
             Sampling sampling, const Context& context) {
  Image out(grid_of(set.lattice, box), volume.type, volume.components);
  refill_into(set, box, volume, background, sampling, out, context);
  return out;
}

}  // namespace ecorche::runtime
