// SPDX-License-Identifier: Apache-2.0
// The patient in a CT: what is inside the skin.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::scan {

struct CtBody {
  std::vector<std::uint8_t> inside;  ///< of each voxel, 0 or 1
  double taken_off_ml = 0;  ///< denser than the threshold, yet no part of the patient: table, clothes
};

/// What is denser than `threshold` (in the image's units; -300 HU parts skin from air), without what hangs on
/// it by less than `bridge_mm` (the table, blankets), with hollows filled layer by layer of k. The patient is
/// the largest piece, and every piece that holds one of `known`, where it is not empty: voxels that are
/// surely of the patient, as labels say. `image` has one component. O(voxels) in time and memory.
CtBody find_body(const Image& image, double threshold, double bridge_mm,
                 const std::vector<std::uint8_t>& known, const Context& context);

}  // namespace ecorche::scan
