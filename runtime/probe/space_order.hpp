// SPDX-License-Identifier: Apache-2.0
// Points along curves through space: what follows each other there lies together.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace ecorche::runtime {

using SpaceCell = std::array<std::uint32_t, 3>;  ///< each below 1024

/// Where along Hilbert's curve through 1024^3 cells a cell lies: neighbours on the curve share a face.
/// Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707 (2004).
std::uint32_t hilbert_place(SpaceCell cell);

/// The same along Morton's, which leaps but costs a tenth.
std::uint32_t morton_place(const SpaceCell& cell);

/// The box of `low` and `high` cut into 1024ths of its longest side.
class SpaceOrder {
 public:
  SpaceOrder(const std::array<float, 3>& low, const std::array<float, 3>& high);

  /// What lies beyond the box, as its border; what is no number, as its lowest corner.
  SpaceCell cell(const float* point) const;

  /// `places`: #P, each below 2^30. Their rows in ascending order, equal ones in their own.
  static std::vector<std::uint32_t> sorted(std::span<const std::uint32_t> places);

 private:
  std::array<float, 3> low_;
  float scale_;
};

}  // namespace ecorche::runtime
