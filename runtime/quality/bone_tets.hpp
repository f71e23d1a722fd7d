// SPDX-License-Identifier: Apache-2.0
// Whether the tets of bones moved rigidly (Sujar18 3.3), by posed nodes alone.
#pragma once

#include <cstdint>
#include <span>

#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

struct BoneTets {
  /// Of an edge's length: beyond it, and beyond what rounding posed nodes to float32 can do (4 steps at the
  /// farthest coordinate, 5e-4 mm at a metre), a tet is changed.
  static constexpr double changed_by = 1e-4;

  std::uint64_t count = 0;
  std::uint64_t inverted = 0;    ///< of no positive posed volume
  std::uint64_t changed = 0;     ///< the inverted ones among them
  double largest_change_mm = 0;  ///< of any edge
};

/// `nodes`: 3 * #nodes, posed, LPS mm. Over the tets with a bone's label. Parallel, the same for any number
/// of threads.
BoneTets measure_bone_tets(const Model& model, std::span<const float> nodes);

}  // namespace ecorche::runtime
