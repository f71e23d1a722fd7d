// SPDX-License-Identifier: Apache-2.0
// What a body made ready for posing holds in memory, for who has a better place for it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace ecorche::runtime {

/// The bytes of arrays that stay as they are for as long as their owner lives.
using HeldArrays = std::vector<std::span<const std::byte>>;

/// Adds a vector's, or a matrix's.
template <class Array>
void add_array(const Array& array, HeldArrays& out) {
  out.push_back(std::as_bytes(std::span(array.data(), static_cast<std::size_t>(array.size()))));
}

}  // namespace ecorche::runtime
