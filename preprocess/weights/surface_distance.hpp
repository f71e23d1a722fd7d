// SPDX-License-Identifier: Apache-2.0
// Exact distance from a point to a triangle surface.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/values/mesh.hpp"

namespace ecorche::weights {

/// Squared distance, mm^2, from `p` to the triangle a, b, c (which may be degenerate).
double squared_distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// A tree of boxes over the triangles of a surface, which must outlive it. O(#F log #F) to build; a query
/// visits the few boxes nearer than the best triangle so far.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const SurfaceMesh& surface);
  /// Squared distance, mm^2, to the nearest triangle; infinity for a surface without any.
  double squared(const Eigen::Vector3d& p) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    std::int32_t begin = 0, end = 0;  ///< triangles of a leaf, in `order_`
    std::int32_t right = -1;          ///< the left child follows its parent; -1 marks a leaf
  };
  void build(std::int32_t begin, std::int32_t end);

  const SurfaceMesh& surface_;
  std::vector<std::int32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace ecorche::weights
