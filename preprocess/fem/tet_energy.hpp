// SPDX-License-Identifier: Apache-2.0
// The energy of one tet and its derivatives in the places of its nodes.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "preprocess/fem/material.hpp"
#include "preprocess/fem/mesh.hpp"

namespace ecorche::fem {

struct TetEnergy {
  double energy = 0;
  double least_j = 1;  ///< det F at the worst point of integration: 0 or less is an inverted tet
  double mean_j = 1;   ///< posed volume over that at rest
};
/// `x`: as Mesh::X, posed, mm.
TetEnergy tet_energy(const Mesh& mesh, const Material& material, std::size_t t, const Points& x);

struct TetDerivatives {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 30, 1> gradient;  ///< 3 * nodes of the element
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 30, 30> hessian;
};
/// `filtered`: positive semi-definite, every point of integration by its eigen-system (isotropic.hpp). For
/// `p2p0` the rank-one part of the mean dilatation is so by itself.
TetDerivatives tet_derivatives(const Mesh& mesh, const Material& material, std::size_t t, const Points& x,
                               bool filtered);

}  // namespace ecorche::fem
