// SPDX-License-Identifier: Apache-2.0
// A template laid near a scan's bones: each segment to its own.
#pragma once

#include "preprocess/scan/place_template.hpp"
#include "preprocess/scan/template_cloud.hpp"

namespace ecorche::scan {

/// Whether a point lies in the image's voxels.
bool in_view(const ImageGrid& grid, const Eigen::Vector3d& p);

/// Mean distance of the scan's points to the template's and back, of those in view, each at most kReach, over
/// kReach.
double misfit_of(const std::vector<SegmentCloud>& clouds, const std::vector<Similarity>& placed,
                 const Points& bone, const geometry::NearestPoint& nearest, const ImageGrid& grid);

/// The template as one rigid piece of kSmallest to kLargest of its size: iterated nearest points.
Similarity fit_whole(const Points& own, const Points& bone, const ImageGrid& grid, Similarity place,
                     const Context& context);

/// The most that a segment is larger or smaller than the body.
inline constexpr double kOddSegment = 1.18;

/// mm: pairs farther apart than this at first are none.
inline constexpr double kFirstReach = 60;

struct SegmentsFit {
  double size = 1;  ///< of the body over the template's
  double first_reach = kFirstReach;
  std::vector<std::uint8_t> held{};  ///< segments that stay where they are; empty: none
};

/// Of the last of the segments in play: a body whose bones become known on the way grows and shrinks with it.
double size_of_last(const std::vector<SegmentCloud>& clouds, const std::vector<Similarity>& placed);

/// From where `placed` has them.
void fit_segments(const BodyTemplate& body, const std::vector<SegmentCloud>& clouds, const Points& bone,
                  const ImageGrid& grid, const SegmentsFit& how, std::vector<Similarity>& placed,
                  const Context& context);

}  // namespace ecorche::scan
