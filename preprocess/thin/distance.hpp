// SPDX-License-Identifier: Apache-2.0
// Distance of every object voxel to the nearest background voxel (Gagvani01 3.1).
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <variant>

#include <ecorche/values/context.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>
#include "preprocess/thin/field.hpp"
#include "preprocess/thin/mask.hpp"

namespace ecorche::thin {

/// Between voxel centres, in voxels; 0 in the background, which goes on beyond the image on every side.
struct DistanceMap {
  DistanceMetric metric = DistanceMetric::euclidean;
  std::array<std::int32_t, 3> size{0, 0, 0};  ///< voxels along i, j, k; i runs fastest
  /// Squares (euclidean) in 16 bits where they fit, else in 32; <3,4,5> in bytes where they fit (a distance
  /// up to 84 voxels), else in 16 bits.
  std::variant<Field<std::uint8_t>, Field<std::uint16_t>, Field<std::uint32_t>> values;

  /// As VolumetricSkeleton::distance has it.
  std::uint32_t at(std::size_t offset) const {
    return std::visit([&](const auto& v) { return static_cast<std::uint32_t>(v[offset]); }, values);
  }
};

/// Exact for either metric: euclidean, the least sum of squares over all background voxels (SaitoToriwaki94;
/// here a windowed minimum along each axis, which vectors run through faster than a lower envelope);
/// chamfer345, the least 3 a + b + c over all of them, a >= b >= c the differences along the axes
/// (Borgefors96, two passes). Euclidean runs on all threads, the same bytes for any number of them. Spacing
/// plays no part. Euclidean O(voxels * radius), chamfer O(voxels).
DistanceMap distance_map(const Mask& mask, DistanceMetric metric, const Context& context);

/// The square of the distance in mm with a spacing of its own along each axis: bit for bit the least, over
/// all background voxels, of (sx dx)^2 + (sy dy)^2 + (sz dz)^2 as doubles round it, added in this order.
Field<double> squared_distance_mm(const Mask& mask, const Context& context);

}  // namespace ecorche::thin
