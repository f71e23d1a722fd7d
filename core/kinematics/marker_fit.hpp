// SPDX-License-Identifier: Apache-2.0
// Poses out of markers.
#pragma once

#include <vector>

#include <ecorche/kinematics/ik.hpp>

namespace ecorche::kinematics {

/// A marker's segment, and its place on the scanned body.
struct MarkerOnBody {
  std::size_t segment = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< LPS mm
};

/// How one set of points lies beside another: y = scale * turn * x + way, least squares (Kabsch76, its scale
/// by Umeyama91). Pairs with a NaN are passed over; `pairs` counts the others.
struct Similarity {
  double scale = 1;
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  int pairs = 0;
};
Similarity similarity(const std::vector<Eigen::Vector3d>& x, const std::vector<Eigen::Vector3d>& y);

/// The pose in which the markers are nearest to `seen` (mm LPS; NaN: not seen), from `start`, or, where that
/// is null, from the scan laid onto them. Throws what solve_ik throws.
IkResult fit_markers(const Rig& rig, const std::vector<MarkerOnBody>& markers,
                     const std::vector<Eigen::Vector3d>& seen, const Pose* start);

}  // namespace ecorche::kinematics
