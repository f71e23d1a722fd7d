// SPDX-License-Identifier: Apache-2.0
#include "io/image/renumber.hpp"

namespace ecorche::io {

Image renumber(const Image& labels, const std::map<std::int64_t, std::uint16_t>& numbers) {
  Image out(labels.grid, ScalarType::u16);
  const auto to = out.scalars<std::uint16_t>();
  with_scalar_type(labels.type, [&](auto zero) {
    using T = decltype(zero);
    const auto from = labels.scalars<T>();
    T last{};
    std::uint16_t number = 0;  // neighbours are mostly alike
    for (std::size_t v = 0; v < from.size(); ++v) {
      if (from[v] != last) {
        last = from[v];
        const auto found = numbers.find(static_cast<std::int64_t>(last));
        number = found == numbers.end() ? std::uint16_t{0} : found->second;
      }
      to[v] = number;
    }
  });
  return out;
}

}  // namespace ecorche::io
