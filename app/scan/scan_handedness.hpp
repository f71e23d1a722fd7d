// SPDX-License-Identifier: Apache-2.0
// Whether a body is turned in its image, or its left and right are exchanged: front and back tell.
#pragma once

#include <array>
#include <vector>

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

enum class Handedness : std::uint8_t {
  unknown,   ///< nothing tells front from back, or head from feet
  body,      ///< left, front and head are as in a body, however that lies
  mirrored,  ///< as in a mirror: names or axes are wrong
};

/// `middle[e + 1]` is that of entry e, and `to_left` leads from right bones to left ones, by their names, LPS
/// mm. Front from back by what lies before what in every body: sternum and ribs before the thoracic spine,
/// hip bones before the sacrum, the mandible before the neck, toes before heels.
Handedness handedness(const ScanCase& scan, const std::vector<std::array<double, 3>>& middle,
                      const std::array<double, 3>& to_left);

/// Whether organs lie on the sides where names of bones have them: 1 yes, -1 no, 0 none tells. A liver is on
/// the right, a spleen and a stomach on the left.
int organs_agree(const ScanCase& scan, const std::vector<std::array<double, 3>>& middle,
                 const std::array<double, 3>& to_left);

}  // namespace ecorche::app
