// SPDX-License-Identifier: Apache-2.0
// A joint amid two sides of which the case has one.
#pragma once

#include <ecorche/values/context.hpp>
#include "preprocess/rig/joint_sources.hpp"

namespace ecorche::rig {

/// A joint whose rule begins with `between` the joints of both sides (a root amid two hips), one of which has
/// no bone: it lies beside the other in the mid-plane, that of constant x through the middle one of the
/// middles of all bones without a side, with a confidence of 0.4 at most and a warning.
void keep_lone_in_middle(const Skeleton& skeleton, JointSources& sources, const Context& context);

}  // namespace ecorche::rig
