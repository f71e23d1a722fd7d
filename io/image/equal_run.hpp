// SPDX-License-Identifier: Apache-2.0
// Labels come in long runs: eight bytes at a time are looked at.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ecorche::io {

/// Where the run of `*first` ends; `last` where it does not. `first` is not `last`.
template <class T>
const T* end_of_run(const T* first, const T* last) {
  constexpr std::ptrdiff_t step = 8 / sizeof(T);
  std::array<T, static_cast<std::size_t>(step)> same;
  same.fill(*first);
  std::uint64_t pattern = 0;
  std::memcpy(&pattern, same.data(), 8);
  const T* at = first;
  for (; last - at >= step; at += step) {
    std::uint64_t word = 0;
    std::memcpy(&word, at, 8);
    if (word != pattern) break;
  }
  // By bytes, as above.
  const auto bytes = [](const T* of) { return std::bit_cast<std::array<std::byte, sizeof(T)>>(*of); };
  while (at != last && bytes(at) == bytes(first)) ++at;
  return at;
}

}  // namespace ecorche::io
