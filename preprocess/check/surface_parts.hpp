// SPDX-License-Identifier: Apache-2.0
// The separate parts of one surface: specks beside it, and surfaces inside of it.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "core/geometry/surface_edges.hpp"

namespace ecorche::check {

struct Part {
  std::int64_t triangles = 0;
  Eigen::AlignedBox3d box;
  double volume_mm3 = 0;      ///< signed
  bool closed = false;        ///< every edge has two triangles
  std::int32_t inside = -1;   ///< the smallest closed part around this one, if it is closed and such there is
  std::int32_t triangle = 0;  ///< its first
};

struct SurfaceParts {
  geometry::TriangleClasses classes;  ///< part of every triangle
  std::vector<Part> parts;
  std::int32_t largest = -1;  ///< by the diagonal of its box

  /// Smaller than `size_mm` across (diagonal of its box), and not the largest part.
  bool speck(std::int32_t part, double size_mm) const;
};

/// A part lies inside another when its first vertex does: parts that cross are told by their intersections.
/// O(#F log #F), and O(#F) for each part whose box holds another's.
SurfaceParts surface_parts(const SurfaceMesh& mesh);

/// Parts smaller than this are called specks, mm.
inline constexpr double speck_mm = 2;

}  // namespace ecorche::check
