// SPDX-License-Identifier: Apache-2.0
// Bones whose names say the wrong side.
#pragma once

#include <set>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>

namespace ecorche::rig {

/// The segments, those of both sides, whose left bones lie on the right of the body and the other way round;
/// empty of skeletons other than `human`. The body's left follows from what has no side: up along trunk or
/// legs, back from toes to feet, from jaw to head, from sternum to vertebrae and from hip bones to sacrum;
/// without any of those it is the scan's. Forearms, hands, shanks, feet and toes, which may cross, are on the
/// side of the bones that they are nearest to.
std::set<std::string> exchanged_sides(const Case& patient);

/// One warning that names those segments and what to do.
void warn_exchanged(const std::set<std::string>& exchanged, const Context& context);

/// Of each joint of `skeleton` whether its centre or axes, or the axes that its rest is measured from, come
/// from those segments.
std::vector<bool> resting_on(const Case& patient, const Skeleton& skeleton,
                             const std::set<std::string>& exchanged);

}  // namespace ecorche::rig
