// SPDX-License-Identifier: Apache-2.0
// Unit vectors in 16 bits: the octahedral map (Meyer10), 8 bits an axis.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace ecorche::wire {

/// `unit`: 3 per row, any length above 0; `out`: 2 per row, in 127ths. A zero vector becomes (-128, -128).
void to_oct16(std::span<const std::int16_t> unit, std::span<std::int8_t> out);

/// The unit vector of two numbers, within 1 degree of what went in; zero for (-128, -128).
std::array<float, 3> from_oct16(std::int8_t u, std::int8_t v);

}  // namespace ecorche::wire
