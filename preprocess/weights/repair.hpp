// SPDX-License-Identifier: Apache-2.0
// Solved weights that left [0, 1]: measured and mended row by row.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include "core/solve/spd_solver.hpp"

namespace ecorche::weights {

/// Linear elements keep 0 <= w <= 1 only where no off-diagonal is positive; slivers break it. The
/// rule: a row that left [0, 1] is clamped and divided by its sum, which moves its weights by about as much
/// as they had left.
struct Repair {
  std::uint64_t rows = 0;     ///< rows that left [0, 1] by more than kRounding
  double largest_change = 0;  ///< of any weight
  std::int32_t worst_node = -1;
};

inline constexpr double kRounding = 1e-9;  ///< below it a violation is the solver's rounding, not the mesh's

/// `values` is #nodes by #columns, as solved; mended in place. Rows of nodes with fixed[n] are not looked at.
Repair repair(const std::vector<std::uint8_t>& fixed, solve::Block& values);

}  // namespace ecorche::weights
