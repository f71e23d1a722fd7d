// SPDX-License-Identifier: Apache-2.0
// The shape of one tet: its volume and its dihedral angles.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace ecorche::geometry {

/// Six volumes over the cube of the longest edge: below it a tet is flat or a needle, and its gradients are
/// rounding. Slivers above it are held by a bound on their angles.
inline constexpr double flat_tet = 1e-9;

struct TetShape {
  double det = 0;              ///< six signed volumes
  bool flat = false;           ///< not inverted, and too thin for angles that mean something
  double least_cosine = -1;    ///< of the largest dihedral angle; of a flat tet, 180 degrees
  double greatest_cosine = 1;  ///< of the smallest; of a flat tet, 0 degrees

  bool inverted() const { return det < 0; }
  bool sound() const { return !flat && !inverted(); }
  double least_deg() const { return degrees(greatest_cosine); }
  double greatest_deg() const { return degrees(least_cosine); }

 private:
  static double degrees(double cosine) {
    return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
  }
};

/// Corners a, b, c, d; positive when det(b-a, c-a, d-a) > 0. A NaN makes it flat.
inline TetShape tet_shape(const std::array<Eigen::Vector3d, 4>& corner) {
  TetShape out;
  const auto edge = [&](std::size_t a, std::size_t b) -> Eigen::Vector3d { return corner[b] - corner[a]; };
  out.det = edge(0, 1).cross(edge(0, 2)).dot(edge(0, 3));
  double longest = 0;  // squared
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a + 1; b < 4; ++b) longest = std::max(longest, edge(a, b).squaredNorm());
  }
  out.flat = !(std::abs(out.det) > flat_tet * longest * std::sqrt(longest)) && !(out.det < 0);
  if (out.flat) return out;
  // Outward normals of the faces opposite each corner, up to a common sign.
  const auto face = [&](std::size_t a, std::size_t b, std::size_t c) -> Eigen::Vector3d {
    return edge(a, b).cross(edge(a, c)).normalized();
  };
  const std::array<Eigen::Vector3d, 4> normal{face(1, 2, 3), face(0, 3, 2), face(0, 1, 3), face(0, 2, 1)};
  out.least_cosine = 1;
  out.greatest_cosine = -1;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a + 1; b < 4; ++b) {
      const double cosine = -normal[a].dot(normal[b]);
      out.least_cosine = std::min(out.least_cosine, cosine);
      out.greatest_cosine = std::max(out.greatest_cosine, cosine);
    }
  }
  return out;
}

}  // namespace ecorche::geometry
