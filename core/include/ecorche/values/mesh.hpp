// SPDX-License-Identifier: Apache-2.0
// Surfaces and tetrahedral meshes: one row per vertex, LPS, mm.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>  // tet_det uses cross
#include <cstdint>
#include <vector>

namespace ecorche {

using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;           ///< #V by 3, mm
using PointsF = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;           ///< #V by 3, mm, run time
using Triangles = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;  ///< #F by 3, rows of V
using Tets = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 4, Eigen::RowMajor>;       ///< #T by 4, rows of V

/// A triangle surface; triangles run counter-clockwise seen from outside.
struct SurfaceMesh {
  Points V;     ///< #V by 3
  Triangles F;  ///< #F by 3
};

/// Tets with one label each. Positive volume: det(b-a, c-a, d-a) > 0.
struct TetMesh {
  /// Label of a tet that lies in no bone. A tet of bone i of the case carries i + 1.
  static constexpr std::uint16_t soft = 0;

  Points V;                          ///< #V by 3
  Tets T;                            ///< #T by 4
  std::vector<std::uint16_t> label;  ///< #T
};

/// Six times the signed volume of tet (a, b, c, d).
template <class A>
double tet_det(const A& a, const A& b, const A& c, const A& d) {
  const Eigen::Vector3d u = (b - a).template cast<double>().transpose();
  const Eigen::Vector3d v = (c - a).template cast<double>().transpose();
  const Eigen::Vector3d w = (d - a).template cast<double>().transpose();
  return u.cross(v).dot(w);
}

}  // namespace ecorche
