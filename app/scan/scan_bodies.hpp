// SPDX-License-Identifier: Apache-2.0
// Two people in one scan: a mother and her child, or what was written into one image by mistake.
#pragma once

#include "app/scan/scan_case.hpp"

namespace ecorche::app {

/// Adds one doubt where bones that a body has once are there twice, far apart, and holds the confidence of
/// such bones down. A broken bone, one whose middle is missing and one that the image's border cuts are in
/// pieces, too, and are no sign of a second body.
void tell_bodies(ScanCase& out, const Context& context);

}  // namespace ecorche::app
