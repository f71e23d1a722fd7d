// SPDX-License-Identifier: Apache-2.0
// Why no case can be made of a scan, and what the user can do about it.
#pragma once

#include <string>
#include <vector>

#include "app/scan/label_names.hpp"
#include "app/scan/scan_bounds.hpp"

namespace ecorche::app {

/// What was given and might have been the skin, but is not where the bones are.
struct SkinPlace {
  std::string what;  ///< `the body of body.nii.gz`
  Bounds bounds;
  double covers = 0;  ///< share of the bones
};

/// `exposed`: the share of bone on the outside of all that is labelled. Throws Error{data}.
[[noreturn]] void refuse_without_skin(const Scan& scan, double exposed, const Bounds& bones,
                                      const std::vector<SkinPlace>& tried);

/// `counted`: voxels of each of `names.named`. Throws Error{data}.
[[noreturn]] void refuse_without_bones(const Scan& scan, const LabelNames& names,
                                       const std::vector<std::size_t>& counted);

}  // namespace ecorche::app
