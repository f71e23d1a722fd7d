// SPDX-License-Identifier: Apache-2.0
#include "runtime/probe/space_order.hpp"

#include <algorithm>

namespace ecorche::runtime {
namespace {

// Ten bits, two zeros between.
std::uint32_t spread(std::uint32_t bits) {
  bits = (bits | bits << 16U) & 0x030000ffU;
  bits = (bits | bits << 8U) & 0x0300f00fU;
  bits = (bits | bits << 4U) & 0x030c30c3U;
  return (bits | bits << 2U) & 0x09249249U;
}

}  // namespace

std::uint32_t morton_place(const SpaceCell& cell) {
  return spread(cell[0]) | spread(cell[1]) << 1U | spread(cell[2]) << 2U;
}

SpaceOrder::SpaceOrder(const std::array<float, 3>& low, const std::array<float, 3>& high) : low_(low) {
  float side = 1e-6F;
  for (std::size_t a = 0; a < 3; ++a) side = std::max(side, high[a] - low[a]);
  scale_ = 1023 / side;
}

SpaceCell SpaceOrder::cell(const float* point) const {
  SpaceCell cell;
  for (std::size_t a = 0; a < 3; ++a) {
    const float x = (point[a] - low_[a]) * scale_;
    cell[a] = x >= 0 ? static_cast<std::uint32_t>(std::min(x, 1023.0F)) : 0U;
  }
  return cell;
}

void SpaceOrder::sort(std::span<const std::uint32_t> places, std::vector<std::uint32_t>& order,
                      std::vector<std::uint32_t>& other) {
  constexpr std::size_t digit = 2048;
  order.resize(places.size());
  other.resize(places.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
  for (const unsigned shift : {0U, 11U, 22U}) {
    const auto bin = [&](std::uint32_t i) { return places[i] >> shift & (digit - 1); };
    std::array<std::uint32_t, digit + 1> begin{};
    for (const std::uint32_t i : order) ++begin[bin(i) + 1];
    if (begin[1] == places.size()) continue;
    for (std::size_t b = 0; b < digit; ++b) begin[b + 1] += begin[b];
    for (const std::uint32_t i : order) other[begin[bin(i)]++] = i;
    order.swap(other);
  }
}

}  // namespace ecorche::runtime
