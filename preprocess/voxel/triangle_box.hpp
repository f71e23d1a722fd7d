// SPDX-License-Identifier: Apache-2.0
// Whether a triangle meets a voxel, in integers.
#pragma once

#include <array>
#include <cstdint>

#include "preprocess/voxel/snapped_surface.hpp"

namespace ecorche::voxel {

/// A triangle's shadow along an axis, against the squares that voxels throw. `corners` in units, voxels by
/// index; u and v are the axes after `axis`, in their turn.
class TriangleShadow {
 public:
  TriangleShadow() = default;
  TriangleShadow(const std::array<Vec3i, 3>& corners, std::size_t axis);
  bool overlaps(int u, int v) const {  ///< only for squares within the shadow's own box
    for (const Edge& e : edges_)
      if (e.nu * u + e.nv * v + e.limit < 0) return false;
    return true;
  }
  /// The triangle's normal along `axis`, twice the shadow's area.
  std::int64_t normal() const { return normal_; }

 private:
  struct Edge {
    std::int64_t nu, nv, limit;  // the square at (u, v) meets the inner side: nu u + nv v + limit >= 0
  };
  std::int64_t normal_ = 0;
  std::array<Edge, 3> edges_{};
};

/// Exact triangle and box overlap (SchwarzSeidel10: box, plane and the edges of three shadows are all
/// separating axes there are), in integers.
class TriangleBoxTest {
 public:
  explicit TriangleBoxTest(const std::array<Vec3i, 3>& corners);
  bool overlaps(int i, int j, int k) const;  ///< only for voxels within the triangle's own box

 private:
  std::array<TriangleShadow, 3> shadows_;
  std::int64_t plane_low_, plane_high_;
};

}  // namespace ecorche::voxel
