// SPDX-License-Identifier: Apache-2.0
// What can be counted on one surface.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::check {

/// A number of offenders, and where the first one lies (LPS mm), in the order of the triangles.
struct Offenders {
  std::int64_t count = 0;
  std::optional<Eigen::Vector3d> first;
};

/// A loop of open edges.
struct Hole {
  std::int64_t edges = 0;
  double length_mm = 0;
  double filling_edge = 0;  ///< mm: of a square as large as its filling; 0 where its edges form no loop
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< mean of its vertices
};

struct SurfaceFigures {
  std::int64_t vertices = 0, triangles = 0;
  Offenders open;               ///< edges of one triangle: holes
  Offenders nonmanifold;        ///< edges of three triangles or more
  Offenders flipped;            ///< edges that both their triangles run along the same way
  std::vector<Hole> holes;      ///< loops of the open edges, the longest first
  Offenders turned;             ///< triangles against the most of their patch
  Offenders duplicate;          ///< triangles whose three corners an earlier one has
  Offenders degenerate;         ///< triangles with two equal corners, or an area below 1e-12 mm^2
  std::int64_t components = 0;  ///< of triangles that share vertices
  double volume_mm3 = 0;        ///< enclosed, signed: negative where triangles look inward; rough where open
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();  ///< bounds

  bool closed() const { return open.count == 0 && nonmanifold.count == 0 && flipped.count == 0; }
};

/// Edges are counted without the triangles that have two equal corners. O(#F log #F).
SurfaceFigures measure(const SurfaceMesh& mesh);

}  // namespace ecorche::check
