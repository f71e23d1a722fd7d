// SPDX-License-Identifier: Apache-2.0
// Names that motion files have for the same joint.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace ecorche::kinematics {

/// `mixamorig:Left_Up Leg` -> `leftupleg`: without prefix, case, spaces, '_' and '-'.
std::string plain_name(std::string_view name);

/// Every name, plain, that known skeletons (CMU's BVH and ASF, glTF humanoids and VRM, Mixamo, Character
/// Creator, Unreal, Biped, OpenSim bodies) give to what one of `names` means, the nearest relatives first;
/// none of `names` themselves.
std::vector<std::string> synonyms(const std::vector<std::string>& names);

/// The joints of one file, plain; in files that call the clavicle a collar, and so the arm a shoulder
/// (`LeftCollar, LeftShoulder, LeftElbow`), each by the name that the others have for it.
std::vector<std::string> plain_names(const std::vector<std::string>& joints);

}  // namespace ecorche::kinematics
