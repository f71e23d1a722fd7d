// SPDX-License-Identifier: Apache-2.0
// Small pieces of structures: voxels that a segmentation left somewhere.
#pragma once

#include <vector>

#include "app/scan/scan_case.hpp"
#include "preprocess/scan/pieces.hpp"

namespace ecorche::app {

/// Takes pieces of less than a hundredth of their structure off, which is noted; their voxels become the
/// body's where `in_body` is not 0, else nothing. Returns the pieces, those that are gone without voxels.
/// Counts of `out.entries` are of before.
scan::Pieces take_specks_off(ScanCase& out, const std::vector<std::uint8_t>& in_body, const Context& context);

}  // namespace ecorche::app
