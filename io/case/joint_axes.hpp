// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "io/case/frame.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {

/// A joint frame from two or three of its axes, `{x: [..], y: [..], z: [..]}` in `frame`: the first one given
/// keeps its direction, the next is made perpendicular to it, the last follows; columns in LPS, orthonormal,
/// right-handed. Axes that are orthonormal already are kept as they are. Refuses fewer than two, collinear
/// and left-handed ones.
Eigen::Matrix3d read_joint_axes(const yaml::Value& value, const Frame& frame);

}  // namespace ecorche::io
