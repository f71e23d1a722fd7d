// SPDX-License-Identifier: Apache-2.0
// Last step: what the field of view cuts, and what is not there.
#pragma once

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// Fills `cut` of the entries and `caps` of the skin, and says which bones are stumps.
void tell_borders(ScanCase& out, const Context& context);

/// The share of bone among the faces between labelled voxels and the air around them, 1 where there are none;
/// hollows and the image's borders do not count.
double exposed_bone(const ScanCase& out, const Context& context);

/// Adds a doubt for each bone whose usual neighbour is missing though it ought to be in view: ribs without a
/// sternum, a tibia without a fibula.
void tell_missing(ScanCase& out);

}  // namespace ecorche::app
