// SPDX-License-Identifier: Apache-2.0
// How far a point is from a surface.
#pragma once

#include <memory>

#include "core/values/mesh.hpp"

namespace ecorche::voxel {

/// Squared distance from `p` to triangle (a, b, c), mm^2 (Ericson05, 5.1.5; degenerate triangles too).
double squared_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c);

/// Exact distances to one surface by a tree of boxes over its triangles. O(#F log #F) to build.
class NearestSurface {
 public:
  explicit NearestSurface(const SurfaceMesh& surface);  ///< `surface` must outlive it and hold a triangle
  ~NearestSurface();
  NearestSurface(NearestSurface&&) noexcept;
  double squared_distance(const Eigen::Vector3d& p) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace ecorche::voxel
