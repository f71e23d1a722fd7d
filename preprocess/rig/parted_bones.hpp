// SPDX-License-Identifier: Apache-2.0
// Joints of bones that were not segmented, but parted by a template: of a CT alone, or of one label of many.
#pragma once

#include <string>

#include <ecorche/values/skeleton.hpp>

namespace ecorche::rig {

/// Whether it is the skeleton of such a body: `human_parted`.
bool is_parted(const Skeleton& skeleton);

/// What a body of parted bones is, once its joints were found.
inline constexpr const char* whole_of_parted = "human";

/// The most that a joint of such bones is sure: a half where it is expected 10 mm off the same joint of
/// segmented bones. Joints that were not measured: a third.
double parted_confidence(const std::string& joint);

}  // namespace ecorche::rig
