// SPDX-License-Identifier: Apache-2.0
// How well a posed body remembers where its points came from.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/values/context.hpp"
#include "core/values/mesh.hpp"
#include "preprocess/mapping/bind.hpp"

namespace ecorche::mapping {

struct RoundTrip {
  std::uint64_t points = 0;  ///< the tets' centroids, each weighed by its tet's rest volume
  double mean_mm = 0;        ///< |inverse(forward(x)) - x|
  double mean_voxels = 0;    ///< the same after `to_voxels`
  double max_mm = 0;
  double elsewhere_share = 0;  ///< of the rest volume, that comes back by another tet than it went
};

/// forward(x) by the tet of x; inverse by the tet that holds the posed point, the one that is squeezed most
/// where several do (TetGrid::most_squeezed): most of what lies there is from it. Where the posed body
/// overlaps itself the two may differ, by as much as lies between the overlapping
/// parts. `to_voxels` counts lengths in an image's voxels, each as long as it is along its axis: the inverse
/// of the axes times the spacing.
RoundTrip round_trip(const PointsF& rest, const PointsF& posed, const Tets& tets, const Context& context,
                     const Eigen::Matrix3d& to_voxels = Eigen::Matrix3d::Identity());

/// Gives the points of `binding` (of posed `points` in the posed tets) that several tets hold, or only
/// inverted ones, to the tet by which they come back best, as above; the others keep theirs.
void bind_to_most_squeezed(const Points& points, const PointsF& rest, const PointsF& posed, const Tets& tets,
                           Binding& binding, const Context& context);

}  // namespace ecorche::mapping
