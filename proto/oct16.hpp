// SPDX-License-Identifier: Apache-2.0
// Unit vectors in 16 bits: the octahedral map (Meyer10), 8 bits an axis.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ecorche::wire {

/// `unit`: 3 per row, any length above 0; `out`: 2 per row, in 127ths. A zero vector becomes (-128, -128).
void to_oct16(std::span<const std::int16_t> unit, std::span<std::int8_t> out);

/// The unit vector of two numbers, within 1 degree of what went in; zero for (-128, -128).
std::array<float, 3> from_oct16(std::int8_t u, std::int8_t v);

/// from_oct16() of all pairs, which takes a root and divisions each time.
class Oct16Table {
 public:
  Oct16Table();
  const std::array<float, 3>& of(std::int8_t u, std::int8_t v) const { return units_[row(u, v)]; }

 private:
  static std::size_t row(std::int8_t u, std::int8_t v) {
    return std::size_t{static_cast<std::uint8_t>(u)} << 8U | static_cast<std::uint8_t>(v);
  }
  std::vector<std::array<float, 3>> units_;
};

/// Made once, when it is first asked for. From any thread.
const Oct16Table& oct16_table();

}  // namespace ecorche::wire
