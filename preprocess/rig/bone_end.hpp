// SPDX-License-Identifier: Apache-2.0
// The end of a bone that a joint lies at, in a frame of its own: places on a bone that nobody marked.
#pragma once

#include <optional>

#include <ecorche/values/mesh.hpp>

namespace ecorche::rig {

struct BoneEnd {
  /// Columns: z along the shaft, to the side of LPS z; x and y those of LPS after the smallest turn that
  /// brings LPS z there. A limb that lies bent takes its frame with it; one that points up (an arm over the
  /// head) has x, y and z turned by that half circle.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  double inward = 1;                                 ///< +1 where z leads from the end into the bone, else -1
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< amid the end, at its tip
  double width = 1;  ///< mm, the larger of its sizes along x and y within half a width of the tip

  /// In widths: across along x and y, and how deep below the tip.
  Eigen::Vector3d place(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d from = axes.transpose() * (p - origin) / width;
    return {from.x(), from.y(), inward * from.z()};
  }
};

/// The end of `bone` that is nearest to `other`. The shaft is the longest principal axis of its vertices, or,
/// of a piece that is hardly longer than wide, leads from the end to the middle of the bone. One vertex in
/// two hundred may lie beyond the tip, one in fifty beyond each side: so a badly registered one moves
/// nothing. Nothing where either surface is empty, or the bone has no size.
std::optional<BoneEnd> bone_end(const SurfaceMesh& bone, const SurfaceMesh& other);

}  // namespace ecorche::rig
