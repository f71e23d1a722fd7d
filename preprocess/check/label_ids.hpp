// SPDX-License-Identifier: Apache-2.0
// Whether a label table and its image speak of the same ids.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>

#include <ecorche/values/image.hpp>

namespace ecorche::check {

struct LabelUse {
  std::int64_t voxels = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();  ///< centre of its first voxel, LPS mm
};

/// Every id of the image but 0. One pass.
std::map<std::int64_t, LabelUse> label_ids(const Image& labels);

}  // namespace ecorche::check
