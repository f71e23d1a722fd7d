// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/resample.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// From a continuous index of the posed grid to `target` of the rest point, by the inverse of tet t's
// deformation.
class RestMap {
 public:
  RestMap(const Model& model, std::span<const float> nodes, const ImageGrid& grid, const Affine& target)
      : model_(model), nodes_(nodes), posed_index_(to_index(grid)), target_(target) {}

  const Affine& of(std::int32_t tet) {
    if (tet == current_) return map_;
    current_ = tet;
    const std::span<const float> rest(model_.nodes.data(), static_cast<std::size_t>(model_.nodes.size()));
    Eigen::Matrix3d posed_edges, rest_edges;
    const Vector3d posed0 = posed_index_ * corner_of(model_.tets, nodes_, tet, 0);
    const Vector3d rest0 = target_ * corner_of(model_.tets, rest, tet, 0);
    for (int c = 1; c < 4; ++c) {
      posed_edges.col(c - 1) = posed_index_ * corner_of(model_.tets, nodes_, tet, c) - posed0;
      rest_edges.col(c - 1) = target_ * corner_of(model_.tets, rest, tet, c) - rest0;
    }
    map_.linear = rest_edges * posed_edges.inverse();
    map_.at = rest0 - map_.linear * posed0;
    return map_;
  }

 private:
  const Model& model_;
  std::span<const float> nodes_;
  Affine posed_index_, target_;
  std::int32_t current_ = InverseMap::none;
  Affine map_;
};

// Calls f(offset, index, rest) for every voxel that a tet holds; a task is a slice.
template <class F>
void for_held_voxels(const Model& model, std::span<const float> nodes, const InverseMap& map,
                     const Affine& target, F f) {
  const ImageGrid& grid = map.grid;
  tbb::parallel_for(std::int32_t{0}, grid.size[2], [&](std::int32_t k) {
    RestMap rest(model, nodes, grid, target);
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

template <class T>
T to_scalar(double value) {
  if constexpr (std::is_integral_v<T>) {
    // Half away from zero, as std::round, but without a call: the value fits once it is clamped.
    const double fits = std::clamp(value, static_cast<double>(std::numeric_limits<T>::min()),
                                   static_cast<double>(std::numeric_limits<T>::max()));
    return static_cast<T>(fits < 0 ? fits - 0.5 : fits + 0.5);
  } else {
    return static_cast<T>(value);
  }
}

// Samples of a volume at continuous indices of its own grid.
template <class T>
struct Sampler {
  const ImageGrid& grid;
  std::span<const T> values;
  std::size_t components;
  double background;

  bool inside(double i, double j, double k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < grid.size[0] && j < grid.size[1] && k < grid.size[2];
  }
  const T* at(double i, double j, double k) const {
    return &values[components * grid.offset(static_cast<int>(i), static_cast<int>(j), static_cast<int>(k))];
  }

  void nearest(const Vector3d& index, T* out) const {
    const Vector3d whole = (index.array() + 0.5).floor();
    if (!inside(whole.x(), whole.y(), whole.z())) return;  // `out` holds the background
    std::copy_n(at(whole.x(), whole.y(), whole.z()), components, out);
  }

  // All eight corners are there: the same sum in the same order.
  void within(const T* first, const Vector3d& part, T* out) const {
    const std::size_t row = components * static_cast<std::size_t>(grid.size[0]);
    const std::size_t slice = row * static_cast<std::size_t>(grid.size[1]);
    const double x1 = part.x(), y1 = part.y(), z1 = part.z(), x0 = 1 - x1, y0 = 1 - y1, z0 = 1 - z1;
    for (std::size_t c = 0; c < components; ++c) {
      const T *p = first + c, *q = p + slice;
      const auto value = [](const T* sample) { return static_cast<double>(*sample); };
      double sum = x0 * y0 * z0 * value(p) + x1 * y0 * z0 * value(p + components);
      sum += x0 * y1 * z0 * value(p + row);
      sum += x1 * y1 * z0 * value(p + row + components);
      sum += x0 * y0 * z1 * value(q);
      sum += x1 * y0 * z1 * value(q + components);
      sum += x0 * y1 * z1 * value(q + row);
      sum += x1 * y1 * z1 * value(q + row + components);
      out[c] = to_scalar<T>(sum);
    }
  }

  void trilinear(const Vector3d& index, T* out) const {
    const Vector3d low = index.array().floor();
    const Vector3d part = index - low;
    if (std::is_integral_v<T> && inside(low.x(), low.y(), low.z()) &&
        inside(low.x() + 1, low.y() + 1, low.z() + 1)) {
      return within(at(low.x(), low.y(), low.z()), part, out);
    }
    for (std::size_t c = 0; c < components; ++c) {
      double sum = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const Vector3d step(corner & 1, corner >> 1 & 1, corner >> 2);
        const Vector3d p = low + step;
        const double weight = (step.x() > 0 ? part.x() : 1 - part.x()) *
                              (step.y() > 0 ? part.y() : 1 - part.y()) *
                              (step.z() > 0 ? part.z() : 1 - part.z());
        if (weight == 0) continue;
        sum += weight *
               (inside(p.x(), p.y(), p.z()) ? static_cast<double>(at(p.x(), p.y(), p.z())[c]) : background);
      }
      out[c] = to_scalar<T>(sum);
    }
  }
};

}  // namespace

Image resample(const Model& model, std::span<const float> nodes, const InverseMap& map,
               const ModelVolume& volume, Sampling sampling) {
  Image out(map.grid, volume.image.type, volume.image.components);
  with_scalar_type(volume.image.type, [&](auto zero) {
    using T = decltype(zero);
    const std::span<T> posed = out.scalars<T>();
    std::fill(posed.begin(), posed.end(), to_scalar<T>(volume.background));
    const auto components = static_cast<std::size_t>(volume.image.components);
    const Sampler<T> sampler{volume.image.grid, volume.image.scalars<T>(), components, volume.background};
    const bool nearest = volume.labels || sampling == Sampling::nearest;
    for_held_voxels(model, nodes, map, to_index(volume.image.grid),
                    [&](std::size_t offset, const Vector3d&, const Vector3d& rest) {
                      T* voxel = &posed[components * offset];
                      nearest ? sampler.nearest(rest, voxel) : sampler.trilinear(rest, voxel);
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
  for_held_voxels(model, nodes, map, Affine{},
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
