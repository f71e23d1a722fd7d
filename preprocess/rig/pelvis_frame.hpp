// SPDX-License-Identifier: Apache-2.0
// How a pelvis lies in its scan, by its shape alone.
#pragma once

#include <Eigen/Core>
#include <optional>

#include <ecorche/values/case.hpp>

namespace ecorche::rig {

/// The rotation that takes the axes of a body that stands straight (LPS) to those of the body of this pelvis:
/// left along the longest principal axis of its bones' surface, up along the second, but for the angle by
/// which that leans back in adults. It turns and mirrors with the bones. Nothing where the surface is not
/// spread as that of a whole pelvis is, and where it lies more than 60 degrees askew: a pelvis alone does not
/// show which side is its left one.
std::optional<Eigen::Matrix3d> pelvis_frame(const Case& patient);

}  // namespace ecorche::rig
