// SPDX-License-Identifier: Apache-2.0
// Labels that look like bone in the CT, whatever they are called.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "app/scan/scan_input.hpp"

namespace ecorche::app {

/// Of the labels `asked` of `layer` those that are as dense as bone in `ct`, and as uneven (a shell and
/// marrow; a vessel with contrast medium is even), in increasing order.
std::vector<std::int64_t> labels_like_bone(const Image& layer, const std::set<std::int64_t>& asked,
                                           const ScanImage& ct);

}  // namespace ecorche::app
