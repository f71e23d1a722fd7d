// SPDX-License-Identifier: Apache-2.0
// Where on the body warnings are about.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>
#include "app/report/picture.hpp"
#include "preprocess/parting/cut_contacts.hpp"

namespace ecorche::app::report {

/// Warnings that differ in nothing but the names of joints, bones and tissues.
struct WarningGroup {
  std::string text;                 ///< the first of them, as it was said
  std::vector<std::string> joints;  ///< of the model, that any of them names
  std::vector<std::string> tissues;
  std::size_t count = 0;
};

/// In the order of their first.
std::vector<WarningGroup> grouped(const Model& model, const std::vector<std::string>& warnings);

struct Place {
  std::string caption;
  Picture picture;
};

/// What a group names, within 8 cm of what surrounds it, from the front: tissues in colour, with rings about
/// their vertices that lie in no tet, and rings about joints. Asks that it names something.
Place place_of(const Model& model, const WarningGroup& group);

/// The bones and all joints from the front and from the left; a ring says how sure a joint's centre is: green
/// from confidence 0.8, yellow from 0.5, red below.
std::vector<Place> rig_pictures(const Model& model, int pixels);

/// The same with rings where limbs were cut free.
std::vector<Place> contact_pictures(const Model& model, const std::vector<parting::CutContact>& contacts,
                                    int pixels);

/// Corners of the box about the tets.
struct Box {
  Eigen::Vector3d low, high;
};
Box box_of(const Model& model);

}  // namespace ecorche::app::report
