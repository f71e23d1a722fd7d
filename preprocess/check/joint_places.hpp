// SPDX-License-Identifier: Apache-2.0
// How far a joint is from the bones that it joins.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/skeleton.hpp>
#include "core/geometry/face_tree.hpp"

namespace ecorche::check {

/// All bones of one segment.
struct SegmentBones {
  SurfaceMesh surface;
  Eigen::AlignedBox3d box;
  std::unique_ptr<geometry::FaceTree> tree;  ///< null: it has none
  /// Unit, along the longest principal axis, where the bones are at least three times as long as wide.
  std::optional<Eigen::Vector3d> shaft;

  double length() const { return box.isEmpty() ? 0 : box.sizes().maxCoeff(); }
  Eigen::Vector3d middle() const { return surface.V.colwise().mean().transpose(); }
  /// mm; infinite without bones.
  double distance(const Eigen::Vector3d& p) const;
};

/// By row of the skeleton's segments.
std::vector<SegmentBones> bones_of(const Case& patient, const Skeleton& skeleton);

/// Least distance of the vertices of `a` (400 of them) from `b`, and amid what is nearest; nothing where
/// either has no bones.
struct Gap {
  double mm = 0;
  Eigen::Vector3d amid = Eigen::Vector3d::Zero();
};
std::optional<Gap> gap_between(const SegmentBones& a, const SegmentBones& b);

/// Of the joint of `row` from its own bones and its parent's: infinite where they have none.
struct Place {
  double own = 0, parent = 0;
  double length = 0;  ///< of the longer of both bones, mm
  double nearest() const { return std::min(own, parent); }
  /// A joint lies in or between the ends of its bones: a tenth of the longer bone is more than half of what a
  /// knee is wide (a femur's condyles measure 0.18 of its length, Terzidis et al. 2012). No joint space is
  /// wider than the gap between both bones, which comes on top.
  double near() const { return 0.1 * length; }
};
Place place_of(const Skeleton& skeleton, const std::vector<SegmentBones>& bones, std::size_t row,
               const Eigen::Vector3d& at);

}  // namespace ecorche::check
