// SPDX-License-Identifier: Apache-2.0
// A correction taken over from a coarser model of the same body: finite elements are solved where they are
// cheap.
#pragma once

#include "preprocess/correct/calibrate.hpp"

namespace ecorche::correct {

/// What `to` needs so that each sample of `from`'s correction puts its nodes where it puts the same places of
/// `from`: between the corners of the tet that holds a node at rest, linear; outside, as beside the nearest
/// tet (see hold). Less, down to nothing, where the two models' weights differ.
/// Less than `least_mm` is not kept. `joints`: names of those that are taken, all where there are none.
/// Throws Error{usage} for rigs that differ, a model without correction, and a name that it does not correct.
Calibration transfer(const Model& from, const Model& to, const std::vector<std::string>& joints,
                     double least_mm, const Context& context);

}  // namespace ecorche::correct
