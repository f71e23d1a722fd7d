// SPDX-License-Identifier: Apache-2.0
// Which segments one joint turns against each other.
#pragma once

#include <cstdint>

#include <ecorche/values/skeleton.hpp>

namespace ecorche::runtime {

/// Whether bones of two segments slide past one another in a joint: one hangs on the other, or both are of a
/// compound joint, whose centres are less than 50 mm apart, as kneecap and shin are. A hand and a thigh that
/// it touches are not, nor are the two thighs. `a` differs from `b`.
bool share_joint(const Skeleton& skeleton, std::int32_t a, std::int32_t b);

}  // namespace ecorche::runtime
