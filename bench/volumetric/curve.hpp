// SPDX-License-Identifier: Apache-2.0
// What thinning leaves of an object and what the object loses by it (Gagvani01 figure 5, sections 4-5).
#pragma once

#include <nlohmann/json.hpp>

#include "preprocess/thin/mask.hpp"

namespace ecorche::bench {

std::size_t object_voxels(const thin::Mask& mask);

/// Skeletal voxels and reconstruction loss (percent of the object in no ball) against TP, 0.1 to 1.2, with
/// their exponential fits; and the skeletons with as large a share of the object as the paper's have.
nlohmann::json curve(const thin::Mask& mask);

}  // namespace ecorche::bench
