// SPDX-License-Identifier: Apache-2.0
// A CT that comes without a label of any bone: its own bones, cut apart and named.
#pragma once

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// A label map of the bones in the first CT of `scan`, each with how sure it is; what was decided goes to
/// `notes` and `doubts` of `out`. Throws Error{data} where there is no CT, no bone in it, or none that is
/// known; Error{usage} where one limb alone is in view and no side is given.
ScanLabels bones_of_ct(Scan& scan, const ScanOptions& options, ScanCase& out, const Context& context);

}  // namespace ecorche::app
