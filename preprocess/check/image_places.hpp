// SPDX-License-Identifier: Apache-2.0
// Images that do not lie where the body does.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>

namespace ecorche::check {

struct Misplaced {
  std::string name;                              ///< of the volume; `labels` is the label map
  std::string what;                              ///< with mm
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< LPS mm
  std::string mend;
};

/// Every image of the case against its skin, and against its label map: one that the body does not meet, one
/// that a hundredth of the skin's vertices lie outside of by more than two voxels and a hundredth of the
/// body's length, and one that has the label map's voxels (their number and size) in another place, by more
/// than half a voxel. Volumes in their order, then the labels. O(#V of the skin * images).
std::vector<Misplaced> misplaced_images(const Case& patient);

}  // namespace ecorche::check
