// SPDX-License-Identifier: Apache-2.0
// Posed volumes by the inverse map of each deformed tet (Sujar18 4).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/values/image.hpp"
#include "core/values/model.hpp"

namespace ecorche::runtime {

enum class Sampling : std::uint8_t { nearest, trilinear };

/// Which tet holds each voxel centre of a posed grid. Filled once per pose, used for any number of volumes on that grid.
struct InverseMap {
  static constexpr std::int32_t none = -1;
  ImageGrid grid;
  std::vector<std::int32_t> tet;  ///< grid.voxels(); `none` outside the posed body
};

/// The grid of `rest` (spacing, direction and lattice kept) grown or shrunk in whole voxels to the posed nodes, but
/// never smaller than `rest`. Throws Error{data} beyond 2^31 voxels.
ImageGrid grow_to(const ImageGrid& rest, std::span<const float> nodes);

/// Every voxel whose centre lies in a posed tet gets one: tets of positive posed volume before inverted ones, then the
/// lowest index. No voxel is lost on a shared face, and the result is the same for any number of threads.
void locate(const Model& model, std::span<const float> nodes, const ImageGrid& grid, InverseMap& out);

/// The rest point, LPS mm, of the centre of voxel `offset` = (i, j, k); only where out.tet is not `none`.
/// `image` must be sampled on its rest grid; samples beyond it are `background`. Labels are always nearest.
Image resample(const Model& model, std::span<const float> nodes, const InverseMap& map, const ModelVolume& volume,
               Sampling sampling);

/// Posed to rest: per voxel of map.grid the vector (rest point - posed point), f32, 3 components, LPS mm, zero outside;
/// and the u8 mask of the voxels where it holds.
struct DisplacementField {
  Image vectors;
  Image mask;
};
DisplacementField inverse_displacement(const Model& model, std::span<const float> nodes, const InverseMap& map);

}  // namespace ecorche::runtime
