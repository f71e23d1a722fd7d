// SPDX-License-Identifier: Apache-2.0
// Angles are radians in code; degrees stand in files, options and text.
#pragma once

#include <numbers>

namespace ecorche {

inline constexpr double degrees_per_radian = 180 / std::numbers::pi;

}  // namespace ecorche
