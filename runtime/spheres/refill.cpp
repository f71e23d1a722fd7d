// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/refill.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/values/error.hpp"
#include "runtime/spheres/lookup.hpp"
#include "runtime/volume/grid_affine.hpp"
#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {
namespace {

// Rest lattice -> index of the volume: axis by axis where both have the same axes.
class ToVolume {
 public:
  ToVolume(const ImageGrid& lattice, const ImageGrid& volume) : map_(to_index(volume) * to_space(lattice)) {
    same_ = true;
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = 0; j < 3; ++j) same_ = same_ && std::abs(map_.linear(i, j) - (i == j)) < 1e-9;
      same_ = same_ && std::abs(map_.at[i] - std::round(map_.at[i])) < 1e-9;
    }
    // The same lattice up to whole voxels, so that rest stays exact.
    if (same_) map_.at = map_.at.array().round();
  }

  Vec3 operator()(const Vec3& p) const {
    if (same_) return {p[0] + map_.at[0], p[1] + map_.at[1], p[2] + map_.at[2]};
    const Eigen::Vector3d q = map_ * Eigen::Vector3d(p[0], p[1], p[2]);
    return {q[0], q[1], q[2]};
  }

 private:
  Affine map_;
  bool same_ = false;
};

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
    for (std::int32_t k = 0; k < tile.size[2]; ++k) {
      for (std::int32_t j = 0; j < tile.size[1]; ++j) {
        T* voxel = &posed[components * out.grid.offset(tile.first[0], tile.first[1] + j, tile.first[2] + k)];
        for (std::int32_t i = 0; i < tile.size[0]; ++i, voxel += components) {
          const std::int32_t owner = tile.owner(i, j, k);
          if (owner == TileOwners::none) continue;
          const Ball& ball = set.balls[static_cast<std::size_t>(owner)];
          const Vec3 at =
              to_volume(rest_place(set, ball, box.first[0] + tile.first[0] + i,
                                   box.first[1] + tile.first[1] + j, box.first[2] + tile.first[2] + k));
          nearest ? sampler.nearest(at[0], at[1], at[2], voxel)
                  : sampler.trilinear(at[0], at[1], at[2], voxel);
        }
      }
    }
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
