// SPDX-License-Identifier: Apache-2.0
// Label maps that give numbers and no names.
#pragma once

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// Names the labels of the map of `scan` that has no names by their shape and place, each with how sure that
/// is. A label that covers bones of several segments is cut by the template. What was decided goes to `notes`
/// and `doubts` of `out`, with coordinates where it is not clear. Does nothing where all maps have names.
/// Throws Error{data} where they look like no part of a body, or where another map has names.
void name_nameless(Scan& scan, const ScanOptions& options, ScanCase& out, const Context& context);

}  // namespace ecorche::app
