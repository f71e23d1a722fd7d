// SPDX-License-Identifier: Apache-2.0
// Bones of a limb that touch, parted at their joint by the cut that crosses the least bone.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include "preprocess/scan/place_template.hpp"
#include "preprocess/scan/template_cloud.hpp"

namespace ecorche::scan {

/// `of` has the row of the template's bones + 1 of each voxel, or 0. At each joint behind a long segment of a
/// limb the voxels of both segments are parted anew, from what lies far enough from the joint on either side,
/// by a minimum cut (BoykovKolmogorov04), where that crosses much less bone than their border of before: a
/// condyle that was flooded from the wrong side comes back. Faces count as more, the farther along the limb
/// they are from where the template has the joint. O(voxels) and a graph of the voxels about a joint.
void part_joints(const BodyTemplate& body, const std::vector<SegmentCloud>& clouds, const Placed& placed,
                 const ImageGrid& grid, std::vector<std::uint16_t>& of, const Context& context);

}  // namespace ecorche::scan
