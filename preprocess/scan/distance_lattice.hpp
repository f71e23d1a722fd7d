// SPDX-License-Identifier: Apache-2.0
// How far any point is from the nearest of some, looked up on a lattice.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include "preprocess/label_surfaces/nearest.hpp"

namespace ecorche::scan {

/// Good to about the lattice's spacing; beyond `reach` of all points: `reach`.
class DistanceLattice {
 public:
  DistanceLattice(const Points& points, double mm, double reach, const Context& context)
      : mm_(mm), reach_(reach) {
    low_ = points.colwise().minCoeff().transpose().array() - reach;
    const Eigen::Vector3d high = points.colwise().maxCoeff().transpose().array() + reach;
    std::array<std::int32_t, 3> size{};
    for (int a = 0; a < 3; ++a) {
      size_[a] = static_cast<int>(std::ceil((high[a] - low_[a]) / mm)) + 1;
      size[static_cast<std::size_t>(a)] = size_[a];
    }
    distance_.assign(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) *
                         static_cast<std::size_t>(size_[2]),
                     label_surfaces::kFar);
    for (Eigen::Index p = 0; p < points.rows(); ++p) distance_[cell(points.row(p).transpose())] = 0;
    std::vector<std::int32_t> none;
    label_surfaces::spread_nearest(distance_, none, size, {mm, mm, mm}, context);
    for (float& d : distance_) d = std::min(std::sqrt(d), static_cast<float>(reach));
  }

  double at(const Eigen::Vector3d& p) const {
    for (int a = 0; a < 3; ++a) {
      const double i = (p[a] - low_[a]) / mm_;
      if (!(i >= 0 && i < size_[a] - 1)) return reach_;
    }
    return static_cast<double>(distance_[cell(p)]);
  }

 private:
  std::size_t cell(const Eigen::Vector3d& p) const {
    const auto i = [&](int a) { return static_cast<std::size_t>(std::lround((p[a] - low_[a]) / mm_)); };
    return i(0) + static_cast<std::size_t>(size_[0]) * (i(1) + static_cast<std::size_t>(size_[1]) * i(2));
  }

  double mm_, reach_;
  Eigen::Vector3d low_;
  Eigen::Vector3i size_;
  std::vector<float> distance_;
};

}  // namespace ecorche::scan
