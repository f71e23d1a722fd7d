// SPDX-License-Identifier: Apache-2.0
// A surface in the integer units of a voxel grid: everything after this is exact.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/image.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::voxel {

/// Units of one voxel. Vertices lie on odd units (cells of 1/256 voxel, at their middle), voxel faces on
/// multiples of 512 and voxel centres on 512 i + 256: no vertex ever lies on a face or a centre, so that a
/// surface drawn along voxel faces touches the voxels of one side only.
inline constexpr std::int32_t units = 512;

/// Most voxels along an axis: then products of three differences fit 63 bits, and every test is exact.
inline constexpr std::int32_t most_voxels_along_axis = 2048;

using Vec3i = std::array<std::int32_t, 3>;

struct SnappedSurface {
  std::vector<Vec3i> V;               ///< #V, units, relative to the low corner of voxel (0, 0, 0)
  const Triangles* F = nullptr;       ///< of the surface that was snapped
  Vec3i low{0, 0, 0}, high{0, 0, 0};  ///< first and last voxel that the surface touches, along each axis
  /// The triangles have no boundary: every edge is run through as often one way as the other (up to a hash of
  /// 64 bits). Only then does every column cross the surface evenly. Edges are told by their snapped places,
  /// so that a slit narrower than 1/256 voxel is closed, and vertices need not be merged.
  bool closed = false;
};

/// Vertices must lie within the grid. `surface` must outlive the result.
SnappedSurface snap(const SurfaceMesh& surface, const ImageGrid& grid);

}  // namespace ecorche::voxel
