// SPDX-License-Identifier: Apache-2.0
// How deep points lie in a bone, looked up.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/geometry/face_tree.hpp"
#include "core/geometry/winding_tree.hpp"

namespace ecorche::runtime {

/// The trees of a closed surface.
struct SurfaceTrees {
  geometry::FaceTree faces;
  geometry::WindingTree winding;

  explicit SurfaceTrees(const SurfaceMesh& surface) : faces(surface), winding(surface) {}

  /// mm to the surface, 0 outside.
  double depth(const Eigen::Vector3d& p) const;
};

/// Signed distances to a closed surface, positive inside, on a lattice over a box, and between its points
/// trilinear: off by at most an eighth of the square of the spacing times the sum of the two curvatures of
/// the surface at that depth, where the nearest triangle does not change.
class DepthGrid {
 public:
  DepthGrid() = default;
  DepthGrid(const SurfaceTrees& trees, const Eigen::AlignedBox3d& box, double spacing_mm);

  /// mm, 0 outside of the surface or of the box.
  float depth(const Eigen::Vector3f& p) const { return std::max(0.0F, between(p)); }

  /// No less than the depth there, mm; negative where the point is that far outside, and out of the box.
  float most(const Eigen::Vector3f& p) const { return between(p) + static_cast<float>(spacing_); }

 private:
  static constexpr int kBlock = 4;  // points along the edge of a block that is asked as one, where it can be

  Eigen::Vector3d point(const Eigen::Vector3i& i) const { return low_ + spacing_ * i.cast<double>(); }
  std::size_t row(const Eigen::Vector3i& i) const {
    const Eigen::Matrix<std::size_t, 3, 1> at = i.cast<std::size_t>(), size = size_.cast<std::size_t>();
    return (at.z() * size.y() + at.y()) * size.x() + at.x();
  }
  float between(const Eigen::Vector3f& p) const;
  void measure(const SurfaceTrees& trees, const Eigen::Vector3i& from, std::vector<std::uint8_t>& rough);
  std::vector<std::uint8_t> inside(const SurfaceTrees& trees) const;
  template <class Each>
  void for_points(Each&& each) const;

  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  double spacing_ = 1;
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::vector<std::int16_t> value_;  // 1/256 mm, x fastest
};

}  // namespace ecorche::runtime
