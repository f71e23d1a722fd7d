// SPDX-License-Identifier: Apache-2.0
// The voxels of one surface: those it touches and those inside it, exactly.
#pragma once

#include <cstdint>
#include <vector>

#include "core/values/context.hpp"
#include "preprocess/voxel/snapped_surface.hpp"

namespace ecorche::voxel {

/// A box of voxels of a grid, i fastest.
struct VoxelMask {
  Vec3i low{0, 0, 0};   ///< its first voxel in the grid
  Vec3i size{0, 0, 0};  ///< voxels along each axis
  std::vector<std::uint8_t> bytes;

  std::size_t offset(int i, int j, int k) const {  ///< of a voxel given in the grid's indices
    return static_cast<std::size_t>(i - low[0]) +
           static_cast<std::size_t>(size[0]) *
               (static_cast<std::size_t>(j - low[1]) +
                static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k - low[2]));
  }
};

inline constexpr std::uint8_t mask_touched = 1;  ///< a triangle meets the closed voxel
inline constexpr std::uint8_t mask_inside = 2;   ///< the winding number of the centre is not 0

/// Exact triangle and box overlap (SchwarzSeidel10: box, plane and the edges of three projections are all
/// separating axes there are), in integers. `corners` in units, the voxel by index.
class TriangleBoxTest {
 public:
  TriangleBoxTest(const Vec3i& a, const Vec3i& b, const Vec3i& c);
  bool overlaps(int i, int j, int k) const;  ///< only for voxels within the triangle's own box

 private:
  struct Edge {
    std::int64_t nu, nv, limit;  // the voxel at (u, v) meets the inner side: nu u + nv v + limit >= 0
  };
  std::int64_t normal_[3];
  std::int64_t plane_low_, plane_high_;
  Edge edges_[3][3];  // [axis projected along][edge]
};

/// Voxels that the surface touches, over its own box grown by `margin` voxels. With `inside`, also the voxels
/// whose centre has a non-zero winding number, from signed crossings along columns in x: the surface must be
/// closed. Overlapping shells count once, an inner shell turned inwards is a cavity, a surface turned inside
/// out counts as well.
VoxelMask rasterize(const SnappedSurface& surface, bool inside, int margin, const Context& context);

}  // namespace ecorche::voxel
