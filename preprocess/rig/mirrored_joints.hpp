// SPDX-License-Identifier: Apache-2.0
// What one side of a body shows badly, its other side may show well.
#pragma once

#include <ecorche/values/context.hpp>
#include "preprocess/rig/joint_sources.hpp"

namespace ecorche::rig {

/// For each pair of joints `NAME_left` and `NAME_right` that are found on bones of both sides: where the
/// mirror image of one (other_side.hpp) lies more than 10 mm (of a hinge across its axis) or 10 degrees off
/// the other, or one was not found, the worse of both is taken from the better, with a confidence of 0.4 at
/// most, and a warning with both numbers. The worse is the one whose bones, its own or its parent's, end
/// before the place; else the one on the bone that is cut (shorter than nine tenths of the other, or on less
/// than four fifths of its surface), else the one of less confidence. Where no bones end, the better has at
/// least `least_confidence`, or 0.2 and is twice as sure as the worse; where it has not, both stay as they
/// are, with a confidence of 0.45 at most, and a warning of each that was sure. So is a segment's long axis
/// taken, where its bones are cut.
void take_other_sides(const Skeleton& skeleton, JointSources& sources, const Context& context);

/// Rest angles that `JointRule::possible` leaves out become those of the other side, where they are possible,
/// or the nearest to 0 that are: the frame turns with them, its confidence is 0.3 or 0.1 at most, and a
/// warning says so.
void keep_rest_possible(const Skeleton& skeleton, JointSources& sources, const Context& context);

}  // namespace ecorche::rig
