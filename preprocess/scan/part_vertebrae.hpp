// SPDX-License-Identifier: Apache-2.0
// The vertebrae of a neck told apart in a CT.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::scan {

/// What lies between two places at which the CT parts a neck: one vertebra, or several that it shows as one.
struct VertebraPiece {
  int first = 1, last = 1;  ///< C1 to C7
  std::size_t voxels = 0;
  double contrast = 0;  ///< 0 to 1: how much darker than the bone beside it the less dark of its two joints
                        ///< is; half where one was not seen
};

struct PartedNeck {
  std::vector<std::uint8_t> of;       ///< of each voxel of the image: row of `pieces` + 1, or 0
  std::vector<VertebraPiece> pieces;  ///< from the top; fewer than two: the neck is one
  std::string why;                    ///< in words, where it is one
};

/// `neck` says which voxels of `ct` are bone of the neck, `other` which are other bones; both run as the
/// image's. `axes`: columns point to the patient's left, back and up, there. `bone` and `skin` as thresholds
/// in the image's values.
///
/// Vertebral bodies are followed by what is bright before the dark canal. Discs are where a plane through
/// them, tilted to the front or back, is darkest; the joints of atlas and axis likewise, beside the dens. The
/// axis, with its dens the tallest, says which is which. From each body the neck is then flooded in order of
/// brightness, so that facets part at their darkest seam. O(volume of the neck / mm^3).
PartedNeck part_neck(const Image& ct, const std::vector<std::uint8_t>& neck,
                     const std::vector<std::uint8_t>& other, const Eigen::Matrix3d& axes, double bone,
                     double skin, const Context& context);

}  // namespace ecorche::scan
