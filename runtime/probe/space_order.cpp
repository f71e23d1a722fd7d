// SPDX-License-Identifier: Apache-2.0
#include "runtime/probe/space_order.hpp"

#include <algorithm>

namespace ecorche::runtime {
namespace {

constexpr unsigned kBits = 10;

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

std::uint32_t hilbert_place(SpaceCell cell) {
  for (std::uint32_t bit = 1U << (kBits - 1); bit > 1; bit >>= 1U) {
    for (std::uint32_t& x : cell) {
      // Either turn the lower bits of the first axis about, or exchange them with this one's: no branch,
      // since no processor could guess it.
      const std::uint32_t below = bit - 1, turn = 0U - static_cast<std::uint32_t>((x & bit) != 0);
      const std::uint32_t exchange = (cell[0] ^ x) & below & ~turn;
      cell[0] ^= (below & turn) | exchange;
      x ^= exchange;
    }
  }
  cell[1] ^= cell[0];
  cell[2] ^= cell[1];
  std::uint32_t turns = 0;
  for (std::uint32_t bit = 1U << (kBits - 1); bit > 1; bit >>= 1U) {
    if ((cell[2] & bit) != 0) turns ^= bit - 1;
  }
  for (std::uint32_t& x : cell) x ^= turns;
  return morton_place({cell[2], cell[1], cell[0]});
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

std::vector<std::uint32_t> SpaceOrder::sorted(std::span<const std::uint32_t> places) {
  std::vector<std::uint32_t> order(places.size()), other(places.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
  for (const unsigned shift : {0U, 10U, 20U}) {
    std::array<std::uint32_t, 1025> begin{};
    for (const std::uint32_t p : places) ++begin[(p >> shift & 1023U) + 1];
    for (std::size_t b = 0; b < 1024; ++b) begin[b + 1] += begin[b];
    for (const std::uint32_t i : order) other[begin[places[i] >> shift & 1023U]++] = i;
    order.swap(other);
  }
  return order;
}

}  // namespace ecorche::runtime
