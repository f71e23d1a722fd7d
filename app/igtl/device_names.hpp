// SPDX-License-Identifier: Apache-2.0
// Names that fit into OpenIGTLink's 20 bytes.
#pragma once

#include <string>
#include <vector>

namespace ecorche::app::igtl {

/// Of each name, in order and all different: itself where it fits; else its beginning, `~` and its end, which
/// tells the side: `gluteus_m~imus_right`. Where two would be the same, a number stands beside the `~`.
/// `names` are different, and ASCII.
std::vector<std::string> device_names(const std::vector<std::string>& names);

}  // namespace ecorche::app::igtl
