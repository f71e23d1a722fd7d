// SPDX-License-Identifier: Apache-2.0
// The way of one tet after the other, from a posed voxel to its rest point.
#pragma once

#include <Eigen/LU>
#include <cstdint>

#include <ecorche/runtime/resample.hpp>
#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {

/// From a continuous index of the posed `grid` to `target` of the rest point, by the inverse of a tet's
/// deformation; made anew where another tet is asked for than before.
class RestMap {
 public:
  RestMap(const Deformation& body, const ImageGrid& grid, const Affine& target)
      : body_(body), posed_index_(to_index(grid)), target_(target) {}

  const Affine& of(std::int32_t tet) {
    if (tet == current_) return map_;
    current_ = tet;
    Eigen::Matrix3d posed_edges, rest_edges;
    const Eigen::Vector3d posed0 = posed_index_ * corner_of(body_.tets, body_.posed, tet, 0);
    const Eigen::Vector3d rest0 = target_ * corner_of(body_.tets, body_.rest, tet, 0);
    for (int c = 1; c < 4; ++c) {
      posed_edges.col(c - 1) = posed_index_ * corner_of(body_.tets, body_.posed, tet, c) - posed0;
      rest_edges.col(c - 1) = target_ * corner_of(body_.tets, body_.rest, tet, c) - rest0;
    }
    map_.linear = rest_edges * posed_edges.inverse();
    map_.at = rest0 - map_.linear * posed0;
    return map_;
  }

 private:
  const Deformation& body_;
  Affine posed_index_, target_;
  std::int32_t current_ = InverseMap::none;
  Affine map_;
};

}  // namespace ecorche::runtime
