// SPDX-License-Identifier: Apache-2.0
// Which tets tell how well a body is posed.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

enum class TetKind : std::uint8_t {
  body,  ///< bone or flesh: what figures of the tets are over
  cap,   ///< where the border of the scan cuts the body (skin_caps.hpp)
  gap,   ///< in a joint, between bones that slide past one another (core/elastic/joint_gaps.hpp)
};

/// Of every tet. O(#T).
std::vector<TetKind> tet_kinds(const Model& model);

}  // namespace ecorche::runtime
