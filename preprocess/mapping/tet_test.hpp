// SPDX-License-Identifier: Apache-2.0
// Whether one tet holds points: its map, made once for all of them.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>

#include <ecorche/values/mesh.hpp>

namespace ecorche::mapping {

/// A coordinate this far below zero still counts as inside: rounding in double, some 1e-9 of a tet's height.
inline constexpr double kHeldRounding = -1e-9;

/// In plain doubles: as 3-vectors, gcc 12 goes through the stack and takes twice the time of the whole
/// mapping. An inverted tet holds nothing.
class TetTest {
 public:
  TetTest(const PointsF& nodes, const Tets& tets, std::int64_t tet) {
    const std::int32_t* n = tets.data() + 4 * tet;
    const auto node = [&](int corner) { return nodes.data() + std::int64_t{3} * n[corner]; };
    const float *a = node(0), *b = node(1), *c = node(2), *d = node(3);
    ax_ = a[0], ay_ = a[1], az_ = a[2];
    const double ux = b[0] - ax_, uy = b[1] - ay_, uz = b[2] - az_;
    const double vx = c[0] - ax_, vy = c[1] - ay_, vz = c[2] - az_;
    const double wx = d[0] - ax_, wy = d[1] - ay_, wz = d[2] - az_;
    vwx_ = vy * wz - vz * wy, vwy_ = vz * wx - vx * wz, vwz_ = vx * wy - vy * wx;
    wux_ = wy * uz - wz * uy, wuy_ = wz * ux - wx * uz, wuz_ = wx * uy - wy * ux;
    uvx_ = uy * vz - uz * vy, uvy_ = uz * vx - ux * vz, uvz_ = ux * vy - uy * vx;
    det_ = ux * vwx_ + uy * vwy_ + uz * vwz_;
    least_ = kHeldRounding * det_;
  }

  /// Faces included.
  bool holds(double x, double y, double z) const {
    const double qx = x - ax_, qy = y - ay_, qz = z - az_;
    // Barycentric coordinates times six volumes.
    const double b1 = qx * vwx_ + qy * vwy_ + qz * vwz_;
    const double b2 = qx * wux_ + qy * wuy_ + qz * wuz_;
    const double b3 = qx * uvx_ + qy * uvy_ + qz * uvz_;
    return std::min(std::min(b1, b2), std::min(b3, det_ - b1 - b2 - b3)) >= least_;
  }

  /// The same tet the right way round: one that is inverted now holds what lies in it.
  TetTest upright() const {
    TetTest out = *this;
    if (det_ >= 0) return out;
    for (double* x : {&out.vwx_, &out.vwy_, &out.vwz_, &out.wux_, &out.wuy_, &out.wuz_, &out.uvx_, &out.uvy_,
                      &out.uvz_, &out.det_, &out.least_})
      *x = -*x;
    return out;
  }
  double det() const { return det_; }  ///< six times the volume, negative where it is inverted

 private:
  double ax_, ay_, az_, vwx_, vwy_, vwz_, wux_, wuy_, wuz_, uvx_, uvy_, uvz_, det_, least_;
};

}  // namespace ecorche::mapping
