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
  gap,   ///< one of elastic::joint_gaps, between bones that one joint turns against each other
};

/// Of every tet. O(#T).
std::vector<TetKind> tet_kinds(const Model& model);

}  // namespace ecorche::runtime
