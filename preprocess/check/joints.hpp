// SPDX-License-Identifier: Apache-2.0
// Joints that cannot be: a centre off the body, an axis that no bone turns about, bones of other segments;
// and a body of a size that none has.
#pragma once

#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include "preprocess/check/inside.hpp"
#include "preprocess/check/inspect_case.hpp"

namespace ecorche::check {

/// Longest extent of the skin, of all bones where there is none, mm.
double body_length(const Case& patient);

/// At most one error: the length against the bounds that the skeleton's file gives, with the unit that would
/// fit; else a skin far shorter than its bones.
std::vector<Finding> size_findings(const Case& patient);

/// One error for each joint of `rig`, which was found for `patient`, that lies outside the skin and its
/// bones (where the skin is open or a shell, that is named instead, once), far from both bones that it joins,
/// or turns (a hinge that flexes) about what is nearly a bone's shaft; and one for two neighbours whose bones
/// are exchanged. Of the `generic` tree, which joins whatever bones lie near each other, they are warnings.
/// `where` is `joint NAME`, `at` its centre. `in_skin`: of the patient's skin.
std::vector<Finding> joint_findings(const Case& patient, const Rig& rig, const Inside& in_skin,
                                    const Context& context);

/// Finds the joints and puts the findings of both behind `report`'s: the rig's warnings as warnings. Nothing
/// is added where the case cannot be prepared anyhow. What the rig refuses is an error like any other.
void inspect_joints(const Case& patient, const Context& context, Report& report);

/// Throws the first error among `findings` as Error{data}; its advice says how many more there are.
void refuse(const std::vector<Finding>& findings);

}  // namespace ecorche::check
