// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

namespace ecorche::elastic {

/// Of one tet at rest.
struct RestTet {
  Eigen::Matrix<double, 4, 3> gradient;  ///< of the barycentric coordinates, 1/mm
  double volume = 0;                     ///< mm^3; what is not positive has no gradients
};

/// Of the corners, row by row.
inline RestTet rest_tet(const Eigen::Matrix<double, 4, 3>& corner) {
  Eigen::Matrix3d edges;
  for (int c = 0; c < 3; ++c) edges.col(c) = (corner.row(c + 1) - corner.row(0)).transpose();
  RestTet out;
  out.volume = edges.determinant() / 6;
  out.gradient.bottomRows<3>() = edges.inverse();
  out.gradient.row(0) = -out.gradient.bottomRows<3>().colwise().sum();
  return out;
}

}  // namespace ecorche::elastic
