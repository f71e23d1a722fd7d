// SPDX-License-Identifier: Apache-2.0
// The built-in patient's bones as a template for those of scans.
#pragma once

#include "preprocess/scan/body_template.hpp"

namespace ecorche::app {

/// With the segments of `skeleton: human`. Made anew at each call, in about a second.
scan::BodyTemplate phantom_template();

}  // namespace ecorche::app
