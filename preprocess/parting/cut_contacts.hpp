// SPDX-License-Identifier: Apache-2.0
// The contacts at which a model was cut, as its provenance has them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>
#include "preprocess/parting/contact_faces.hpp"

namespace ecorche::parting {

/// Names in place of rows.
struct CutContact {
  std::string limb;        ///< its uppermost segment
  std::string other_limb;  ///< that of the other; empty: the rest of the body
  std::string own, other;  ///< the segments that move most of what touched
  double cm2 = 0;
  double confidence = 0;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< LPS, mm
};

/// What a model's provenance says under `cut_contacts`: for each contact `limb other_limb own other cm2
/// confidence x y z`, parted by `;`, `-` for the rest of the body. Without those below half a cm2. Empty
/// where there is none.
std::string cut_contacts_text(const std::vector<Contact>& contacts, const Skeleton& skeleton);

/// As the model's provenance has them; empty where no limb was cut free, or where it says something else.
std::vector<CutContact> cut_contacts(const Model& model);

/// `upper_arm_left was cut free of the trunk: 206 cm2, most of upper_arm_left and thorax, at [x, y, z],
/// confidence 86 %`.
std::string describe(const CutContact& contact);

}  // namespace ecorche::parting
