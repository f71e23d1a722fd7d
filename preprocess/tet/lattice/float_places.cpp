// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/float_places.hpp"

#include <algorithm>
#include <cmath>

namespace ecorche::tet {
namespace {

constexpr int kFinest = 14, kCoarsest = 12;  // a side is between 2^n and 2^(n + 1) units
constexpr double kExact = 1 << 24;           // whole numbers up to here are exact in float32

}  // namespace

Clipped on_float_places(Clipped clipped) {
  const BccLattice& was = clipped.lattice;
  Eigen::Vector3d extent;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    extent[axis] = was.side() * was.cubes()[static_cast<std::size_t>(axis)];
  const Eigen::Vector3d middle = was.low() + 0.5 * extent;
  const double farthest = (middle.cwiseAbs() + 0.5 * extent).maxCoeff() + was.side();
  for (int bits = kFinest; bits >= kCoarsest; --bits) {
    const double unit = std::exp2(std::floor(std::log2(was.side())) - bits);  // centres: halves of it
    if (farthest > kExact * 0.5 * unit) continue;
    const double side = std::round(was.side() / unit) * unit;
    const Eigen::Vector3d low = middle - 0.5 * side / was.side() * extent;
    clipped.lattice = BccLattice(unit * (low / unit).array().round().matrix(), side, was.cubes());
    break;
  }
  return clipped;
}

}  // namespace ecorche::tet
