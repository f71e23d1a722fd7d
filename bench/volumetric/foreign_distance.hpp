// SPDX-License-Identifier: Apache-2.0
// The distance transforms of ITK and VTK, timed as their users call them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace ecorche::bench {

struct ForeignDistance {
  double seconds = 0;          ///< of the filter alone, its image made before
  std::vector<float> squares;  ///< where the image is 1, to the nearest 0 of the image, in voxels squared
};

/// itk::SignedMaurerDistanceMapImageFilter (Maurer03), float, on all its threads.
ForeignDistance itk_distance(const std::array<std::int32_t, 3>& size,
                             const std::vector<std::uint8_t>& inside);
/// vtkImageEuclideanDistance (SaitoToriwaki94), on all its threads.
ForeignDistance vtk_distance(const std::array<std::int32_t, 3>& size,
                             const std::vector<std::uint8_t>& inside);

}  // namespace ecorche::bench
