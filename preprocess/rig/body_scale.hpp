// SPDX-License-Identifier: Apache-2.0
// How large a body is beside an adult's.
#pragma once

#include <ecorche/values/case.hpp>

namespace ecorche::rig {

/// The largest of the whole femurs, humeri and pelvis over an adult's, 0.35 to 1.3; 1 from 0.8 to 1.2, as
/// adults are, of other skeletons than `human`, and where none is whole. A long bone is whole where it is as
/// slender as an adult's and wider at both ends than amid: one that is cut is not, however short it is.
double body_scale(const Case& patient);

}  // namespace ecorche::rig
