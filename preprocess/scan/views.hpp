// SPDX-License-Identifier: Apache-2.0
// What each view of a body holds of the template, and how.
#pragma once

#include <utility>
#include <vector>

#include "preprocess/scan/place_template.hpp"

namespace ecorche::scan {

/// Of an arm below the girdle.
bool of_arm(const std::string& segment);
/// `femur` of `femur_left`.
std::string without_side(const std::string& name);
bool view_has(View view, const std::string& segment);

/// Where the view has each segment of the template, before anything is placed: arms raised about the
/// shoulder.
std::vector<Similarity> held_by(const BodyTemplate& body, View view);

/// The template, held as `view` has it, where it is roughly laid.
Placed laid(const BodyTemplate& body, const Similarity& place, View view);
/// The same place of the trunk, with arms raised that hung, or hanging that were raised. One of a limb alone
/// stays what it is.
Placed with_other_arms(const BodyTemplate& body, Placed placed);

bool of_upper_arm(const BodyTemplate& body, const TemplateBone& bone);
/// Whether the middle of any of its bones is.
bool upper_arm_in_view(const BodyTemplate& body, const Placed& placed, const ImageGrid& grid);

/// The turns that are tried to lay `own` over `theirs`, each with the way along which it is then slid.
std::vector<std::pair<Eigen::Matrix3d, Eigen::Vector3d>> turns_of(View view, const Points& own,
                                                                  const Points& theirs);

/// Those that are looked for: of one limb where a side is given.
std::vector<View> views_of(Side side);

}  // namespace ecorche::scan
