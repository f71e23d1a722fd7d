// SPDX-License-Identifier: Apache-2.0
// Nearest of a set of points, by a uniform grid.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::geometry {

/// About two points a cell. `V` must outlive it.
class NearestPoint {
 public:
  /// Over the rows `subset` of V, of which there must be at least one.
  NearestPoint(const Points& V, const std::vector<std::int32_t>& subset);
  /// Row of V of the point nearest to `p`, ties to the lower row; `distance2` receives the squared distance,
  /// mm^2.
  std::int32_t find(const Eigen::Vector3d& p, double& distance2) const;

 private:
  Eigen::Vector3i cell(const Eigen::Vector3d& p) const;
  std::size_t offset(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size_[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(k));
  }

  const Points& V_;
  std::vector<std::int32_t> rows_;     // by cell
  std::vector<std::int32_t> offsets_;  // #cells + 1
  Eigen::AlignedBox3d box_;
  Eigen::Vector3i size_ = Eigen::Vector3i::Ones();
  double edge_ = 1;
};

}  // namespace ecorche::geometry
