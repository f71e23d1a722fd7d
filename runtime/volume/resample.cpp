// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/resample.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "runtime/volume/grid_affine.hpp"
#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// From a continuous index of the posed grid to `target` of the rest point, by the inverse of tet t's
// deformation.
class RestMap {
 public:
  RestMap(const Deformation& body, const ImageGrid& grid, const Affine& target)
      : body_(body), posed_index_(to_index(grid)), target_(target) {}

  const Affine& of(std::int32_t tet) {
    if (tet == current_) return map_;
    current_ = tet;
    Eigen::Matrix3d posed_edges, rest_edges;
    const Vector3d posed0 = posed_index_ * corner_of(body_.tets, body_.posed, tet, 0);
    const Vector3d rest0 = target_ * corner_of(body_.tets, body_.rest, tet, 0);
    for (int c = 1; c < 4; ++c) {
      posed_edges.col(c - 1) = posed_index_ * corner_of(body_.tets, body_.posed, tet, c) - posed0;
      rest_edges.col(c - 1) = target_ * corner_of(body_.tets, body_.rest, tet, c) - rest0;
    }
    map_.linear = rest_edges * posed_edges.inverse();
    map_.at = rest0 - map_.linear * posed0;
    return map_;
  }

 private:
  const Deformation& body_;
  Affine posed_index_, target_;
  std::int32_t current_ = InverseMap::none;
  Affine map_;
};

// Calls f(offset, index, rest) for every voxel that a tet holds; a task is a slice.
template <class F>
void for_held_voxels(const Deformation& body, const InverseMap& map, const Affine& target, F f) {
  const ImageGrid& grid = map.grid;
  tbb::parallel_for(std::int32_t{0}, grid.size[2], [&](std::int32_t k) {
    RestMap rest(body, grid, target);
    for (std::int32_t j = 0; j < grid.size[1]; ++j) {
      std::size_t offset = grid.offset(0, j, k);
      for (std::int32_t i = 0; i < grid.size[0]; ++i, ++offset) {
        if (map.tet[offset] == InverseMap::none) continue;
        const Vector3d index(i, j, k);
        f(offset, index, Vector3d(rest.of(map.tet[offset]) * index));
      }
    }
  });
}

}  // namespace

Image resample(const Deformation& body, const InverseMap& map, const ModelVolume& volume, Sampling sampling) {
  Image out(map.grid, volume.image.type, volume.image.components);
  with_scalar_type(volume.image.type, [&](auto zero) {
    using T = decltype(zero);
    const std::span<T> posed = out.scalars<T>();
    std::fill(posed.begin(), posed.end(), to_scalar<T>(volume.background));
    const auto components = static_cast<std::size_t>(volume.image.components);
    const Sampler<T> sampler{volume.image.grid, volume.image.scalars<T>(), components, volume.background};
    const bool nearest = volume.labels || sampling == Sampling::nearest;
    for_held_voxels(body, map, to_index(volume.image.grid),
                    [&](std::size_t offset, const Vector3d&, const Vector3d& rest) {
                      T* voxel = &posed[components * offset];
                      nearest ? sampler.nearest(rest.x(), rest.y(), rest.z(), voxel)
                              : sampler.trilinear(rest.x(), rest.y(), rest.z(), voxel);
                    });
  });
  return out;
}

DisplacementField inverse_displacement(const Model& model, std::span<const float> nodes,
                                       const InverseMap& map) {
  DisplacementField out{Image(map.grid, ScalarType::f32, 3), Image(map.grid, ScalarType::u8)};
  const std::span<float> vectors = out.vectors.scalars<float>();
  const std::span<std::uint8_t> mask = out.mask.scalars<std::uint8_t>();
  const Affine space = to_space(map.grid);
  for_held_voxels(deformation(model, nodes), map, Affine{},
                  [&](std::size_t offset, const Vector3d& index, const Vector3d& rest) {
                    const Vector3d moved = rest - space * index;
                    for (std::size_t c = 0; c < 3; ++c) {
                      vectors[3 * offset + c] = static_cast<float>(moved[static_cast<Eigen::Index>(c)]);
                    }
                    mask[offset] = 1;
                  });
  return out;
}

}  // namespace ecorche::runtime
