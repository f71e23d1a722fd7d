// SPDX-License-Identifier: Apache-2.0
// The warnings of a pose as a terminal shows them.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace ecorche::app {

/// At most four lines of the `warnings` of a frame's quality, and how many more there are. Joints that were
/// found badly share a line, and so does what is said of one place: else one fault fills them all.
std::string warning_lines(const nlohmann::json& warnings);

}  // namespace ecorche::app
