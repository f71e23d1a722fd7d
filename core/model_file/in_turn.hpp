// SPDX-License-Identifier: Apache-2.0
// Parts of one work, several at a time, whose failure is that of doing them in turn.
#pragma once

#include <functional>
#include <vector>

namespace ecorche::model_file {

/// Calls every part, in the caller's TBB arena. Throws what the first of those threw that threw anything, so
/// that a file has the same defect for any number of threads; parts behind that one may be left out.
void run_as_in_turn(const std::vector<std::function<void()>>& parts);

}  // namespace ecorche::model_file
