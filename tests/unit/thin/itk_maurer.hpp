// SPDX-License-Identifier: Apache-2.0
// ITK's distance transform (Maurer03), behind plain values.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/image.hpp>

namespace ecorche::foreign {

/// The square of the distance, mm^2, of every voxel that is not 0 to the nearest that is; what lies beyond
/// the image is background too. Rounded by ITK as it does.
std::vector<double> maurer_squared(const ImageGrid& grid, const std::vector<std::uint8_t>& inside);

}  // namespace ecorche::foreign
