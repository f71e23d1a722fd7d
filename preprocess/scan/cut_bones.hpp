// SPDX-License-Identifier: Apache-2.0
// The bones of a scan cut apart where they touch, by a template that lies over them.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include "preprocess/scan/place_template.hpp"

namespace ecorche::scan {

/// How well a template's bone was found.
struct FoundBone {
  std::size_t voxels = 0;  ///< before its marrow was filled
  double agreement = 0;    ///< 0 to 1: share of its voxels near the template's bone, and of that near them
};

struct CutBones {
  std::vector<std::uint16_t> of;  ///< of each voxel: row of the template's bones + 1, or 0
  std::vector<FoundBone> bones;   ///< of each of the template's
  std::size_t left_out = 0;       ///< voxels of bone that lie near no bone of the template
};

/// What a voxel of `mask` surely belongs to is the nearest bone of the placed template, where that is near
/// and bones of other segments are clearly farther. From those seeds the rest is flooded, the deepest first
/// (a watershed on the distance to what is no bone): where bones of two segments touch they part at the
/// narrowest; then the marrow is filled. Pieces that hold no seed go to the nearest bone within kReach, or
/// are left out. O(voxels).
CutBones cut_bones(const std::vector<std::uint8_t>& mask, const ImageGrid& grid, const BodyTemplate& body,
                   const Placed& placed, const Context& context);

/// What one label encloses in a layer of k, and no other borders on, becomes that label where it is at most
/// `most_mm2[label - 1]` large.
void fill_hollows(std::vector<std::uint16_t>& of, const ImageGrid& grid, const std::vector<double>& most_mm2);

/// Floods `of` (0: not yet) within `mask` from what is labelled, through faces and edges, in order of
/// `depth`, the deepest first: each voxel takes the label from which a way leads to it whose shallowest voxel
/// is deepest. All run i fastest over `size` voxels. `step` is the difference of depth that counts.
void watershed(const std::vector<std::uint8_t>& mask, const std::vector<float>& depth,
               const std::array<std::int32_t, 3>& size, double step, std::vector<std::uint16_t>& of,
               const Context& context);

}  // namespace ecorche::scan
