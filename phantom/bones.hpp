// SPDX-License-Identifier: Apache-2.0
// Raw bone solids, before those of neighbouring segments are given their gaps. Left side where there are two.
#pragma once

#include "phantom/body.hpp"

namespace ecorche::phantom {

/// The middle of the spine at height z, mm.
Vec spine_at(double z);

Shape pelvis_bone(const Landmarks& at);
Shape lumbar_spine(const Landmarks& at);
Shape rib_cage(const Landmarks& at);
Shape cervical_spine(const Landmarks& at);
Shape skull_bone(const Landmarks& at);
Shape mandible_bone(const Landmarks& at);
/// The room inside the skull.
Shape skull_cavity();

Shape clavicle_bone(const Landmarks& at);
Shape scapula_bone(const Landmarks& at);
Shape humerus_bone(const Landmarks& at);
Shape ulna_bone(const Landmarks& at);
Shape radius_bone(const Landmarks& at);
Shape hand_bone(const Landmarks& at);
/// Points from the wrist to the tip of digit 0 (thumb) to 4, in the hand's frame: (dorsal, ulnar, proximal),
/// mm.
std::vector<Vec> digit_path(int digit);

Shape femur_bone(const Landmarks& at);
Shape tibia_bone(const Landmarks& at);
Shape fibula_bone(const Landmarks& at);
Shape patella_bone(const Landmarks& at);
Shape foot_bone(const Landmarks& at);
Shape toe_bone(const Landmarks& at);

}  // namespace ecorche::phantom
