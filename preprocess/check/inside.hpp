// SPDX-License-Identifier: Apache-2.0
// Whether a point lies inside a surface that need not be perfect.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "core/geometry/winding_tree.hpp"

namespace ecorche::check {

/// Counts signed crossings along one ray in each of +x, +y and +z. Where they differ, as where rays leave
/// through holes, a generalized winding number decides (geometry/winding_tree.hpp): inside from 1/2. A ray
/// that meets an edge or a corner counts each sheet once (half-open rule, the same intersection for both
/// triangles of an edge). Memory and time to build O(#F), with the first query; a query visits one column a
/// ray.
class Inside {
 public:
  explicit Inside(const SurfaceMesh& surface) : surface_(surface) {}  ///< `surface` must outlive it

  bool operator()(const Eigen::Vector3d& p) const;
  /// Sum of the signed crossings of the ray from `p` along +axis: 1 inside an outward surface, 0 outside.
  int crossings(const Eigen::Vector3d& p, int axis) const;

 private:
  // Triangles by the cell that their shadow along one axis touches.
  struct Columns {
    Eigen::Vector2d low = Eigen::Vector2d::Zero();
    double edge = 1;
    std::array<int, 2> size{1, 1};
    std::vector<std::int32_t> offsets, triangles;
  };
  const Columns& columns(int axis) const;
  Columns build(int axis) const;

  const SurfaceMesh& surface_;
  mutable std::once_flag built_;
  mutable std::array<Columns, 3> columns_;
  mutable std::once_flag asked_;  // closed surfaces never need it
  mutable std::optional<geometry::WindingTree> winding_;
};

}  // namespace ecorche::check
