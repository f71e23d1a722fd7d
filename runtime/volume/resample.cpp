// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/resample.hpp>

#include <tbb/parallel_for.h>

#include <algorithm>

#include <ecorche/runtime/rigid_copies.hpp>
#include "runtime/volume/grid_affine.hpp"
#include "runtime/volume/rest_map.hpp"
#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

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

namespace {

// `f(deformation)` of the drawn tets.
template <class F>
auto as_drawn(const Model& model, std::span<const float> nodes, const F& f) {
  if (model.contested.empty()) return f(deformation(model, nodes));
  const DrawnBody body = drawn_body(model.tets, deformation(model, nodes).rest, nodes, RigidCopies(model));
  return f(Deformation{body.tets, body.rest, body.posed});
}

}  // namespace

void locate(const Model& model, std::span<const float> nodes, const ImageGrid& grid, InverseMap& out,
            const Context& context) {
  as_drawn(model, nodes, [&](const Deformation& body) { locate(body, grid, out, context); });
}

Image resample(const Model& model, std::span<const float> nodes, const InverseMap& map,
               const ModelVolume& volume, Sampling sampling) {
  return as_drawn(model, nodes,
                  [&](const Deformation& body) { return resample(body, map, volume, sampling); });
}

DisplacementField inverse_displacement(const Model& model, std::span<const float> nodes,
                                       const InverseMap& map) {
  DisplacementField out{Image(map.grid, ScalarType::f32, 3), Image(map.grid, ScalarType::u8)};
  const std::span<float> vectors = out.vectors.scalars<float>();
  const std::span<std::uint8_t> mask = out.mask.scalars<std::uint8_t>();
  const Affine space = to_space(map.grid);
  as_drawn(model, nodes, [&](const Deformation& body) {
    for_held_voxels(body, map, Affine{},
                    [&](std::size_t offset, const Vector3d& index, const Vector3d& rest) {
                      const Vector3d moved = rest - space * index;
                      for (std::size_t c = 0; c < 3; ++c) {
                        vectors[3 * offset + c] = static_cast<float>(moved[static_cast<Eigen::Index>(c)]);
                      }
                      mask[offset] = 1;
                    });
  });
  return out;
}

}  // namespace ecorche::runtime
