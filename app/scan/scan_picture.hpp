// SPDX-License-Identifier: Apache-2.0
// A label map seen from the front and from the side.
#pragma once

#include <string>
#include <vector>

#include "app/report/picture.hpp"
#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// What a case's labels look like along an axis of the patient: bones lit from the viewer, in the colours of
/// their segments; organs and vessels fainter behind them; the body as a shadow. `colours` is by entry.
report::Picture picture_of(const ScanCase& scan, bool from_front, int pixels,
                           const std::vector<report::Colour>& colours);

/// A colour for each entry: bones by segment, the same for the same.
std::vector<report::Colour> entry_colours(const ScanCase& scan);

/// Both views side by side.
report::Picture both_views(const ScanCase& scan, int pixels);

}  // namespace ecorche::app
