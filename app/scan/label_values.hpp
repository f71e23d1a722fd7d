// SPDX-License-Identifier: Apache-2.0
// Whether an image holds labels or a picture, as far as its values tell.
#pragma once

#include <cstdint>
#include <optional>
#include <set>

#include <ecorche/values/image.hpp>

namespace ecorche::app {

/// The values of an image that may be labels: whole, none below 0, not too many; without 0.
std::optional<std::set<std::int64_t>> label_values(const Image& image);

/// Whether neighbours differ as they do in pictures, of an image of so many values: labels come in areas.
bool looks_grey(const Image& image, std::size_t values);

}  // namespace ecorche::app
