// SPDX-License-Identifier: Apache-2.0
// What a report counts of a model.
#pragma once

#include <vector>

#include <ecorche/values/model.hpp>
#include "app/report/histogram.hpp"

namespace ecorche::app::report {

/// Smallest and largest dihedral angle, radius ratio and longest edge of the tets; segments above 1e-3 and
/// the largest weight of the nodes. O(#T + #w).
std::vector<Histogram> quality(const Model& model);

/// 3 times the radius of the inscribed sphere over that of the circumscribed one: 1 for a regular tet, 0 for
/// a flat one.
double radius_ratio(const std::array<Eigen::Vector3d, 4>& corner);

}  // namespace ecorche::app::report
