// SPDX-License-Identifier: Apache-2.0
// Joints of a template that iterated nearest points left too high or too low on a limb.
#pragma once

#include "preprocess/scan/place_template.hpp"
#include "preprocess/scan/template_cloud.hpp"

namespace ecorche::scan {

/// Moves each joint along its limb to where the bones on both sides of it lie nearest to the scan's, and
/// fits the segments anew, until that gains nothing. Nearest points alone do not find that place: along a
/// shaft every point has a near one wherever the shaft lies, and thick ends find each other's.
void slide_joints(const BodyTemplate& body, const std::vector<SegmentCloud>& clouds, const Points& bone,
                  const ImageGrid& grid, double size, std::vector<Similarity>& placed,
                  const Context& context);

}  // namespace ecorche::scan
