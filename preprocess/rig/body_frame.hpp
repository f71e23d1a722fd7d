// SPDX-License-Identifier: Apache-2.0
// How a body lies in its scan: what a template calls left, back and up is the body's, not the table's.
#pragma once

#include <Eigen/Core>

#include <ecorche/values/case.hpp>

namespace ecorche::rig {

/// The rotation that takes the axes of a body that stands straight (LPS) to those of this one, as its trunk
/// lies: the best one (least squares, Arun et al. 1987) from the middles of the bones of pelvis, thorax and
/// both girdles as adults have them; a girdle that has far less surface than the other, or than a thorax's
/// girdle, lacks a bone and counts for nothing. Without a thorax, as the pelvis lies (pelvis_frame.hpp). It
/// turns and mirrors with the bones. Identity for other skeletons than `human`, where one of the four has no
/// bone (the pelvis, where there is no thorax), and where they lie as in no body (15 % of their size).
Eigen::Matrix3d body_frame(const Case& patient);

/// The bones, what is said of them and the skeleton, all turned by `turn` about the origin; without skin,
/// tissues and images. Directions that rules say stay: they are the body's.
Case turned(const Case& patient, const Eigen::Matrix3d& turn);

}  // namespace ecorche::rig
