// SPDX-License-Identifier: Apache-2.0
// Surfaces of one body that were exported in different frames or units.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "preprocess/check/inside.hpp"

namespace ecorche::check {

/// A change of axes and unit that brings points into the skin.
struct Agreement {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< a signed permutation
  double scale = 1;                                    ///< 10, 1/10, 100, 1/100, 1000, 1/1000 or 1
  double share = 0;                                    ///< of the points that then lie inside

  /// The frame of the files, if they were taken for LPS: `RAS`, `LSA`, ...
  std::string code() const;
  /// `(x, y, z) -> (-x, z, y)`.
  std::string turn() const;
  /// `and 1000 times as large`, or nothing.
  std::string size() const;
};

/// The change among the 48 axis codes and seven units that brings most points inside; ties to the one that
/// changes least. A change of unit is considered only where the points span less than 0.15 or more than 1.5
/// of `skin_mm`, the skin's largest extent, and afterwards do not. Empty unless it brings at least `least` of
/// the points inside, and `better` more than leaving them alone or mends their span.
std::optional<Agreement> find_agreement(const std::vector<Eigen::Vector3d>& points, const Inside& skin,
                                        double skin_mm, double least = 0.9, double better = 0.3);

/// At most `most` of the vertices, evenly spread along their rows.
std::vector<Eigen::Vector3d> sample_vertices(const SurfaceMesh& mesh, Eigen::Index most);

/// The factor among 10, 100, 1000 and their inverses that brings `length_mm` into [low, high]; 0 for none.
double unit_factor(double length_mm, double low, double high);

}  // namespace ecorche::check
