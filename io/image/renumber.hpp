// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>

#include <ecorche/values/image.hpp>

namespace ecorche::io {

/// `labels` of one component by other ids, u16: what `numbers` does not name becomes 0.
Image renumber(const Image& labels, const std::map<std::int64_t, std::uint16_t>& numbers);

}  // namespace ecorche::io
