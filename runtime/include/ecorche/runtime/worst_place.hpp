// SPDX-License-Identifier: Apache-2.0
// Where a posed body is worst.
#pragma once

#include <Eigen/Core>
#include <span>

#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// A cube of the scanned body that holds a thousandth of its volume: 40 mm wide in an adult.
struct Place {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< mean of its tets' middles, scanned, LPS mm
  double share = 0;                              ///< of the volume of its tets, at rest
};

/// Where a pose does most harm.
struct WorstPlaces {
  double edge_mm = 0;  ///< of every cube; 0: nowhere was looked
  Place inverted;      ///< where most is turned inside out
  Place changed;       ///< where tets change most: sum of |posed - rest|
};

/// A tet counts for the cube that its middle lies in; cubes less than a quarter full are left out, since a
/// tet or two would be all of them. `nodes`: 3 * #nodes, posed, LPS mm;
/// `left_out`: empty, or 1 for each tet that counts nowhere. O(#T).
WorstPlaces worst_places(const Model& model, std::span<const float> nodes,
                         std::span<const std::uint8_t> left_out = {});

}  // namespace ecorche::runtime
