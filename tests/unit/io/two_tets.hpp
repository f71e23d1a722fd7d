// SPDX-License-Identifier: Apache-2.0
// Two tets that share a face.
#pragma once

#include <ecorche/values/mesh.hpp>

namespace ecorche::io {

inline PointsF points() {
  PointsF V(5, 3);
  V << 0, 0, 0, 10, 0, 0, 0, 10, 0, 0, 0, 10, 10, 10, 10.125F;
  return V;
}

inline Tets two() {
  Tets T(2, 4);
  T << 0, 1, 2, 3, 1, 2, 3, 4;
  return T;
}

}  // namespace ecorche::io
