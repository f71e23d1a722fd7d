// SPDX-License-Identifier: Apache-2.0
// What only a preparation shows of a case, without most of its time.
#pragma once

#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include "preprocess/check/inspect_case.hpp"

namespace ecorche::preprocess {

/// Voxels, the default lattice and harmonic weights of the case, as `run` with no option makes them, and what
/// is found on the way: what would refuse the case, an error; limbs that touch, a note each where
/// they come apart, else a warning. Nothing of a
/// case without skin or bones. Throws Error{interrupted} and Error{internal} only.
std::vector<check::Finding> look_ahead(const Case& patient, const Context& context);

}  // namespace ecorche::preprocess
