// SPDX-License-Identifier: Apache-2.0
// The rig of a body whose spine bends at each level: that of the whole spine, split.
#pragma once

#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include "preprocess/rig/joint_evidence.hpp"

namespace ecorche::rig {

/// The bones of the same body with its spine in the four segments of `human`, as all its other joints are
/// found.
Case with_whole_spine(const Case& patient);

/// `whole`, fitted to that, with the levels that `patient` has bones for (core/values/spine.hpp). The lowest
/// of each part of the spine turns where the part did; the others amid the surfaces that they and the level
/// below show each other, about an axis towards the joint above. A note names the levels without a bone of
/// their own. `evidence`, if not null, is one per joint of `whole`, and becomes one per joint of the result.
Rig split_spine(const Case& patient, const Rig& whole, const Context& context,
                std::vector<JointEvidence>* evidence);

}  // namespace ecorche::rig
