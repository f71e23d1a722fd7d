// SPDX-License-Identifier: Apache-2.0
// What in a scan contradicts itself: images that lie elsewhere, left bones to the right of their pairs.
#pragma once

#include <string>
#include <vector>

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// Adds a doubt for each image that covers less than half of what is labelled, and one where left and right
/// contradict front and back (scan_handedness.hpp); a body that only lies turned gets a note. Where neither
/// is so, one for pairs whose left bone lies where all others have their right one.
void tell_contradictions(ScanCase& out, const std::vector<ScanImage>& images);

/// `; mr.nii.gz is no CT in HU (its least value is 0)`, where there are images and none is a CT; else empty.
std::string images_without_hu(const std::vector<ScanImage>& images);

}  // namespace ecorche::app
