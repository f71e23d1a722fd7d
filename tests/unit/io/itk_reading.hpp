// SPDX-License-Identifier: Apache-2.0
// What ITK's own reader, with its types and factories, makes of an image.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

namespace ecorche::foreign {

/// The vector and the place of one voxel of a displacement image, read as itk::Image<itk::Vector<float, 3>,
/// 3>.
struct Displacement {
  std::array<double, 3> vector, point,
      probed;  ///< `probed`: the vector that ITK's linear interpolator gives at `point`
};
Displacement itk_displacement(const std::filesystem::path& path, const std::array<std::int64_t, 3>& index);

}  // namespace ecorche::foreign
