// SPDX-License-Identifier: Apache-2.0
// Caps of a skin that the border of its scan cuts.
#pragma once

#include <string>

#include <ecorche/values/image.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::preprocess {

/// What a model's provenance says under `skin_caps` (<ecorche/runtime/skin_caps.hpp>): for each border of
/// `grid` at which `skin` has a flat piece of at least 1 cm2, `x y z nx ny nz within_mm cm2`, parted by `;`.
/// Empty where there is none.
std::string caps_text(const SurfaceMesh& skin, const ImageGrid& grid);

}  // namespace ecorche::preprocess
