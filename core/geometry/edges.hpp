// SPDX-License-Identifier: Apache-2.0
// The edges of tets: how short float32 lets them be, and what a motion does to them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <ecorche/values/mesh.hpp>

namespace ecorche::geometry {

/// The shortest of the six edges, in the unit of the corners.
inline double shortest_edge(const std::array<Eigen::Vector3d, 4>& corner) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = a + 1; b < 4; ++b) least = std::min(least, (corner[b] - corner[a]).squaredNorm());
  return std::sqrt(least);
}

/// Steps of float32 that an edge must be long: each end is off by at most half a step, so that the edge keeps
/// its length and direction to 1 %, and the map of its tet that of its volume.
inline constexpr double resolved_steps = 100;

/// Edges shorter than this, mm, drown in the float32 rounding of nodes (#V by 3, any precision) where these
/// lie farthest from the origin: 0.006 mm at half a metre, 0.012 at one.
template <class Nodes>
double unresolved_edge(const Nodes& nodes) {
  const double far = nodes.size() == 0 ? 0 : static_cast<double>(nodes.cwiseAbs().maxCoeff());
  const auto at = static_cast<float>(far);
  return resolved_steps *
         static_cast<double>(std::nextafter(at, std::numeric_limits<float>::infinity()) - at);
}

/// How much a motion changes a tet: the largest difference from 1 of an edge's length, or of the signed
/// volume, over what it was; infinite for a flat one. 0 exactly where the motion is rigid; at least 1 where
/// the tet turns inside out.
inline double tet_change(const std::array<Eigen::Vector3d, 4>& rest,
                         const std::array<Eigen::Vector3d, 4>& posed) {
  const auto det = [](const std::array<Eigen::Vector3d, 4>& c) {
    return (c[1] - c[0]).cross(c[2] - c[0]).dot(c[3] - c[0]);
  };
  const auto beside = [](double is, double was) {
    return was == 0 ? std::numeric_limits<double>::infinity() : std::abs(is / was - 1);
  };
  double change = beside(det(posed), det(rest));
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a + 1; b < 4; ++b)
      change = std::max(change, beside((posed[b] - posed[a]).norm(), (rest[b] - rest[a]).norm()));
  }
  return change;
}

}  // namespace ecorche::geometry
