// SPDX-License-Identifier: Apache-2.0
// The weighted metric <3,4,5> of Borgefors96 in two passes.
#pragma once

#include <cstdint>

#include <ecorche/values/context.hpp>
#include "preprocess/thin/field.hpp"
#include "preprocess/thin/mask.hpp"

namespace ecorche::thin {

/// 3 for a step through a face, 4 through an edge, 5 through a corner; 0 in the background and beyond the
/// image. What T cannot hold stays at its largest value, and everything below it is right all the same.
/// O(voxels), one thread: each row waits for the one before.
template <class T>
Field<T> chamfer(const Mask& mask, const Context& context);

extern template Field<std::uint8_t> chamfer(const Mask&, const Context&);
extern template Field<std::uint16_t> chamfer(const Mask&, const Context&);

}  // namespace ecorche::thin
