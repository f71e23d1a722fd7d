// SPDX-License-Identifier: Apache-2.0
// Points along curves through space: what follows each other there lies together.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace ecorche::runtime {

using SpaceCell = std::array<std::uint32_t, 3>;  ///< each below 1024

/// Where along Morton's curve through 1024^3 cells a cell lies.
std::uint32_t morton_place(const SpaceCell& cell);

/// The box of `low` and `high` cut into 1024ths of its longest side.
class SpaceOrder {
 public:
  SpaceOrder(const std::array<float, 3>& low, const std::array<float, 3>& high);

  /// What lies beyond the box, as its border; what is no number, as its lowest corner.
  SpaceCell cell(const float* point) const;

  /// `places`: #P. `order`: their rows in ascending order, equal ones in their own. `other` is scratch; both
  /// are allocated only where they have not been as long.
  static void sort(std::span<const std::uint32_t> places, std::vector<std::uint32_t>& order,
                   std::vector<std::uint32_t>& other);

 private:
  std::array<float, 3> low_;
  float scale_;
};

}  // namespace ecorche::runtime
