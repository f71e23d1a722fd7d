// SPDX-License-Identifier: Apache-2.0
// The points of a template, as one view of it has them, and which is nearest.
#pragma once

#include <memory>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "core/geometry/nearest_point.hpp"
#include "preprocess/scan/body_template.hpp"
#include "preprocess/scan/similarity.hpp"

namespace ecorche::scan {

/// The points of one segment in the template's own place.
struct SegmentCloud {
  Points points;
  std::vector<int> bone;  ///< row of the template's bones, of each point
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;  ///< about the centre
  std::unique_ptr<geometry::NearestPoint> nearest;
};

/// All segments for which `in_play` is not 0; the others are empty.
std::vector<SegmentCloud> segment_clouds(const BodyTemplate& body, const std::vector<std::uint8_t>& in_play);

struct NearestBone {
  int segment = -1, point = -1;  ///< rows; -1: none within reach
  double distance = 0;           ///< mm
};

/// The point of the placed template that is nearest to `p`, none farther than `reach`; of the segments but
/// `except`.
NearestBone nearest_bone(const std::vector<SegmentCloud>& clouds, const std::vector<Similarity>& placed,
                         const Eigen::Vector3d& p, double reach, int except = -1);

}  // namespace ecorche::scan
