// SPDX-License-Identifier: Apache-2.0
// The part of a skeleton that a case has bones for.
#pragma once

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::rig {

/// The skeleton without the segments that own no bone of the case; the root stays, and so do those without
/// bones of their own (`Segment::boneless`) whose joint leads one that does. Children move up to their
/// nearest present ancestor, couplings with a joint that went go with it. A warning names each dropped
/// segment and where it went. Throws Error{config} when a bone's segment is not in the skeleton, or when no
/// segment owns a bone.
Skeleton present_part(const Case& patient, const Context& context);

}  // namespace ecorche::rig
