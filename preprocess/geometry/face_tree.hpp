// SPDX-License-Identifier: Apache-2.0
// The exact nearest triangle of a set.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/values/mesh.hpp"

namespace ecorche::geometry {

/// A bounding volume hierarchy without pointers: triangles along a Morton curve, boxes over each four of
/// them, boxes over each four boxes, and so on. The answer depends on the triangles only: not on the threads,
/// nor on the hint.
class FaceTree {
 public:
  using Corners = std::array<Eigen::Vector3d, 3>;

  struct Hit {
    std::int32_t face = -1;  ///< the lowest of those at this distance; -1 only for an empty tree
    double squared = std::numeric_limits<double>::infinity();  ///< mm^2
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
  };

  /// Triangle i is corners[i].
  explicit FaceTree(const std::vector<Corners>& corners);
  /// Triangle i is row i of F. Nothing of the surface is kept.
  explicit FaceTree(const SurfaceMesh& surface) : FaceTree(corners_of(surface)) {}

  static std::vector<Corners> corners_of(const SurfaceMesh& surface);

  /// The nearest triangle. `hint`: a face of an earlier answer near p, or -1; it saves time only.
  Hit nearest(const Eigen::Vector3d& p, std::int32_t hint = -1) const;

 private:
  static constexpr std::size_t kFan = 4;

  void try_leaf(std::size_t leaf, const Eigen::Vector3d& p, Hit& best) const;

  std::vector<Corners> corners_;                          // along the curve
  std::vector<std::int32_t> face_;                        // of corners_
  std::vector<std::int32_t> place_;                       // of a face in corners_
  std::vector<std::vector<Eigen::AlignedBox3d>> levels_;  // [0] over triangles; the last has one box
};

}  // namespace ecorche::geometry
