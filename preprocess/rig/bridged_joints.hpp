// SPDX-License-Identifier: Apache-2.0
// Joints over a gap: their bones hang on others than those that the rule was made for.
#pragma once

#include <ecorche/values/case.hpp>
#include "preprocess/rig/joint_sources.hpp"

namespace ecorche::rig {

/// A joint whose parent's bones are missing (a forearm whose upper arm lies beyond the image) joins its own
/// to the next that are there. Where its centre then lies farther from its own bones than a joint does, it
/// becomes their end: of a long bone the one away from what hangs on it, else what is nearest to the parent's
/// bones. It has confidence 0.
void keep_bridged_near(const Case& patient, const Skeleton& asked, JointSources& sources);

}  // namespace ecorche::rig
