// SPDX-License-Identifier: Apache-2.0
// Where numbers of 16 bits stand in space.
#pragma once

#include <array>

namespace ecorche::runtime {

/// u16 positions: p = low + step * number on each axis; beyond the box they stay on its side.
struct QuantiseBox {
  std::array<float, 3> low{0, 0, 0};  ///< mm, LPS
  float step = 1;                     ///< mm
};

}  // namespace ecorche::runtime
