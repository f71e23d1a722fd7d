// SPDX-License-Identifier: Apache-2.0
// Markers as a motion, by inverse kinematics.
#pragma once

#include <memory>

#include "app/motion_source.hpp"

namespace ecorche::app {

/// Opens a `.trc`. Its markers' places on the body are the map's `markers`, or joints of the same name. Each
/// frame starts from the one before, so frames are cheap in order, and the same in any order. --motion-unit
/// body scales the markers to the patient. Throws Error{usage} without a map that names a marker, Error{data}
/// for fewer than three known markers or another size than the patient's.
std::unique_ptr<MotionSource> open_markers(const Program& program, const MotionChoice& choice,
                                           const Rig& rig);

}  // namespace ecorche::app
