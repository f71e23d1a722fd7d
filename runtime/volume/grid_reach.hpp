// SPDX-License-Identifier: Apache-2.0
// Which parts of a body can lie in a grid.
#pragma once

#include <cstdint>
#include <span>

#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {

/// Whether a set of boxes reaches into the grid: on either side of each axis, a bit each, one of them must
/// not end short of it.
class GridReach {
 public:
  static constexpr std::uint8_t reaches = 0x3f;

  explicit GridReach(const ImageGrid& grid)
      : index_(to_index(grid)),
        reach_(index_.linear.cwiseAbs()),
        last_(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1) {}

  /// Of the box `low_high` in LPS.
  std::uint8_t sides(std::span<const float, 6> low_high) const {
    const Eigen::Map<const Eigen::Vector3f> low(low_high.data()), high(low_high.data() + 3);
    if (!low.allFinite() || !high.allFinite()) return reaches;
    const Eigen::Vector3d middle = index_ * Eigen::Vector3d((0.5F * (low + high)).cast<double>());
    const Eigen::Vector3d half = reach_ * Eigen::Vector3d((0.5F * (high - low)).cast<double>());
    constexpr double rounding = 1e-2;  // of float32 metres away, in voxels of a tenth of a millimetre
    unsigned out = 0;
    for (int a = 0; a < 3; ++a) {
      out |= middle[a] + half[a] >= -rounding ? 1U << static_cast<unsigned>(a) : 0U;
      out |= middle[a] - half[a] <= last_[a] + rounding ? 8U << static_cast<unsigned>(a) : 0U;
    }
    return static_cast<std::uint8_t>(out);
  }

 private:
  Affine index_;
  Eigen::Matrix3d reach_;  // |linear|
  Eigen::Vector3d last_;
};

}  // namespace ecorche::runtime
