// SPDX-License-Identifier: Apache-2.0
// Posed points back to the scan by the tets that carried them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::mapping {

/// Posing keeps 1e-3 mm (BodyPoser::run); squeezed to less than this share of its length, a tet would turn
/// that into more than 0.05 mm on the way back.
inline constexpr double kLeastStretch = 0.02;

/// Tets at rest and posed; nodes #N by 3, LPS mm. Refers to all three.
struct CarryingTets {
  const PointsF &rest, &posed;
  const Tets& tets;
};

/// Whether the tet is turned inside out, or squeezed below kLeastStretch in some direction: several places of
/// the scan then lie where it is, or too near each other to be told apart.
bool is_folded(const CarryingTets& body, std::int32_t tet);

struct CarriedBack {
  Points points;                     ///< #P by 3, on the scan, LPS mm
  std::vector<std::uint8_t> folded;  ///< #P: 1 where its tet is
};

/// Each of `points` (posed, #P by 3) goes back by its `tet` (#P, rows of tets), in which it lay at rest at
/// the barycentric `share` (#P by 4, signed outside): its rest place, and the tet's inverse gradient times
/// its way from where posing put it. That is the tet's affine inverse, outside of it and inside out too; only
/// a direction squeezed below kLeastStretch is taken as that, so that what was not moved there comes back,
/// and what was moved goes no further than 1 / kLeastStretch times as far. Same for any number of threads.
/// Error{interrupted} on a stop.
CarriedBack carry_back(const CarryingTets& body, const Points& points, std::span<const std::int32_t> tet,
                       const Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor>& share,
                       const Context& context);

}  // namespace ecorche::mapping
