// SPDX-License-Identifier: Apache-2.0
// Segments off the body.
#pragma once

#include <vector>

#include <ecorche/values/case.hpp>
#include "preprocess/check/inside.hpp"
#include "preprocess/check/inspect_case.hpp"

namespace ecorche::check {

/// One error for each segment all of whose bones lie off a closed skin, farther than 2 % of its length:
/// nothing of the body would follow them, and every pose of it would pass. `in_skin`: of its skin.
std::vector<Finding> lost_segments(const Case& patient, const Inside& in_skin);

}  // namespace ecorche::check
