// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/nearest_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ecorche::geometry {

NearestPoint::NearestPoint(const Points& V, const std::vector<std::int32_t>& subset) : V_(V) {
  for (const std::int32_t n : subset) box_.extend(V.row(n).transpose());
  const Eigen::Vector3d extent = box_.sizes().cwiseMax(1e-6 * box_.sizes().maxCoeff()).cwiseMax(1e-9);
  edge_ = std::cbrt(extent.prod() * 2 / static_cast<double>(subset.size()));
  // A flat or thin set must not ask for more cells than it has points along its length.
  edge_ = std::max(edge_, extent.maxCoeff() / 256);
  for (int k = 0; k < 3; ++k) size_[k] = std::max(1, static_cast<int>(std::ceil(extent[k] / edge_)));

  offsets_.assign(offset(0, 0, size_[2]) + 1, 0);
  const auto cell_offset = [&](std::int32_t n) {
    const Eigen::Vector3i c = cell(V_.row(n));
    return offset(c[0], c[1], c[2]);
  };
  for (const std::int32_t n : subset) ++offsets_[cell_offset(n) + 1];
  for (std::size_t c = 1; c < offsets_.size(); ++c) offsets_[c] += offsets_[c - 1];
  rows_.resize(subset.size());
  std::vector<std::int32_t> next(offsets_.begin(), offsets_.end() - 1);
  for (const std::int32_t n : subset) rows_[static_cast<std::size_t>(next[cell_offset(n)]++)] = n;
}

Eigen::Vector3i NearestPoint::cell(const Eigen::Vector3d& p) const {
  Eigen::Vector3i c;
  for (int k = 0; k < 3; ++k) {
    const double at = std::floor((p[k] - box_.min()[k]) / edge_);
    c[k] = static_cast<int>(std::clamp(at, 0.0, static_cast<double>(size_[k] - 1)));
  }
  return c;
}

std::int32_t NearestPoint::find(const Eigen::Vector3d& p, double& distance2) const {
  const Eigen::Vector3i centre = cell(p);
  std::int32_t best = -1;
  distance2 = std::numeric_limits<double>::infinity();
  for (int ring = 0; ring <= size_.maxCoeff(); ++ring) {
    // The points of this ring are at least ring - 1 edges from the point, or from its projection onto the
    // box, to which they are no farther.
    const double nearest = std::max(0, ring - 1) * edge_;
    if (nearest * nearest > distance2) break;
    for (int k = std::max(0, centre[2] - ring); k <= std::min(size_[2] - 1, centre[2] + ring); ++k) {
      for (int j = std::max(0, centre[1] - ring); j <= std::min(size_[1] - 1, centre[1] + ring); ++j) {
        const bool face = std::abs(k - centre[2]) == ring || std::abs(j - centre[1]) == ring;
        const int step = face || ring == 0 ? 1 : 2 * ring;
        for (int i = centre[0] - ring; i <= centre[0] + ring; i += step) {
          if (i < 0 || i >= size_[0]) continue;
          const std::size_t c = offset(i, j, k);
          for (std::int32_t r = offsets_[c]; r < offsets_[c + 1]; ++r) {
            const std::int32_t n = rows_[static_cast<std::size_t>(r)];
            const double d = (V_.row(n).transpose() - p).squaredNorm();
            if (d < distance2 || (d == distance2 && n < best)) {
              distance2 = d;
              best = n;
            }
          }
        }
      }
    }
  }
  return best;
}

}  // namespace ecorche::geometry
