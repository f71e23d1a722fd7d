// SPDX-License-Identifier: Apache-2.0
// How well a posed body remembers where its points came from.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/values/context.hpp"
#include "core/values/mesh.hpp"

namespace ecorche::mapping {

struct RoundTrip {
  std::uint64_t points = 0;  ///< the tets' centroids, each weighed by its tet's rest volume
  double mean_mm = 0;        ///< |inverse(forward(x)) - x|
  double mean_voxels = 0;    ///< the same after `to_voxels`
  double max_mm = 0;
  double elsewhere_share = 0;  ///< of the rest volume, whose posed place another tet holds as well
};

/// forward(x) by the tet of x; inverse by the tet that holds the posed point: one of positive posed volume,
/// the lowest index first, as posed volumes are filled (runtime::locate); where only inverted ones do, the
/// tet of x. Where the posed body overlaps itself the two differ, by as much as lies between the overlapping
/// parts. `to_voxels` counts lengths in an image's voxels, each as long as it is along its axis: the inverse
/// of the axes times the spacing.
RoundTrip round_trip(const PointsF& rest, const PointsF& posed, const Tets& tets, const Context& context,
                     const Eigen::Matrix3d& to_voxels = Eigen::Matrix3d::Identity());

}  // namespace ecorche::mapping
