// SPDX-License-Identifier: Apache-2.0
// A bone laid onto the mirror image of its fellow: what one side shows, the other has too.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include <ecorche/values/mesh.hpp>

namespace ecorche::rig {

/// `thigh_right` of `thigh_left` and the other way round; empty where a name has no side.
std::string other_side(const std::string& name);

/// How the mirror image of one bone lies on its fellow.
struct Laid {
  Eigen::Affine3d map = Eigen::Affine3d::Identity();  ///< mirrors: from the one's space to the other's
  double rms_mm = 0;                                  ///< of the four fifths of the points that lie best
  double share = 1;                                   ///< of the fellow's length that the bone has
  double covered = 1;                                 ///< of the fellow's vertices that lie on the bone
};

/// The map from `whole`'s space to that of `part`, its mirrored fellow or what is left of it: ICP (Besl and
/// McKay 1992) of `part`'s vertices onto the surface of the mirrored `whole`, from 27 starts (the mirror
/// image as it lies, and by principal axes; amid it, at one end and at the other), a fifth of the points left
/// out, so that what was cut, or is not there, counts for nothing. Nothing where either is empty, or where
/// they fit worse than 3 mm or a hundredth of `whole`'s length.
std::optional<Laid> laid_onto(const SurfaceMesh& whole, const SurfaceMesh& part);

}  // namespace ecorche::rig
