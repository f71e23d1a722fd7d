// SPDX-License-Identifier: Apache-2.0
// What others see of what somebody calls themselves.
#pragma once

#include <string>
#include <string_view>

namespace ecorche::server {

/// At most 64 characters of the UTF-8 text, without the blanks around it and without what controls text: line
/// breaks, directions, characters of no width. No name, then, writes over what stands beside it.
std::string display_name(std::string_view text);

}  // namespace ecorche::server
