// SPDX-License-Identifier: Apache-2.0
// Exact squared distances in one width, which `distance_map` chooses.
#pragma once

#include <cstdint>

#include <ecorche/values/context.hpp>
#include "preprocess/thin/field.hpp"
#include "preprocess/thin/mask.hpp"

namespace ecorche::thin {

/// Squares of distances in voxels, 0 in the background, for T of 16 or 32 bits. In 16 bits what is more than
/// 65534 becomes 65535, and everything below it is right all the same.
template <class T>
Field<T> squared_distance(const Mask& mask, const Context& context);

/// Whether 16 bits were enough: no square is 65535.
bool holds_all(const Field<std::uint16_t>& squares);

extern template Field<std::uint16_t> squared_distance(const Mask&, const Context&);
extern template Field<std::uint32_t> squared_distance(const Mask&, const Context&);

}  // namespace ecorche::thin
