// SPDX-License-Identifier: Apache-2.0
// Points in continuous indices of a grid as whole numbers, so that differences of neighbours are exact.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/image.hpp>

namespace ecorche::runtime {

/// Bits of the fraction that leave room for indices up to `reach` voxels from zero, and for differences of
/// two: at most 20, at least 10. `reach` beyond 2^19 is cut there, and so are the points.
int fraction_bits(double reach);

/// The largest index, either way along any axis, that a box of LPS corners reaches on `grid`.
double index_reach(const ImageGrid& grid, std::span<const float, 6> low_high);

/// 2^bits times the continuous index on `grid` of every point, rounded; `points` and `out` are 3 * #P. What
/// is no number becomes the far end. Parallel, the same for any number of threads.
void to_fixed(const ImageGrid& grid, int bits, std::span<const float> points, std::span<std::int32_t> out);

/// The same for those groups of 64 points whose byte of `groups` is not 0; the others are left as they are.
void to_fixed(const ImageGrid& grid, int bits, std::span<const float> points,
              std::span<const std::uint8_t> groups, std::span<std::int32_t> out);

}  // namespace ecorche::runtime
