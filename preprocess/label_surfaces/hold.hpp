// SPDX-License-Identifier: Apache-2.0
// Where a vertex of a net may be.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>

#include "preprocess/label_surfaces/net_cells.hpp"
#include "preprocess/label_surfaces/surface_net.hpp"

namespace ecorche::label_surfaces {

/// Below half a voxel, so that the two sides of a plate one voxel thick never meet.
inline constexpr double kReach = 0.45;
/// Where several loops share a cell they stay by their own voxels.
inline constexpr double kReachBeside = 0.2;

/// The nearest point to `p` of the quarter of a voxel's face that crosses `edge` of the unit cell.
inline Eigen::Vector3d on_square(const Eigen::Vector3d& p, int edge) {
  const int axis = edge / 4, from = kEdgeCorners[static_cast<std::size_t>(edge)][0];
  Eigen::Vector3d q;
  for (int a = 0; a < 3; ++a) {
    const double low = (from >> a & 1) != 0 ? 0.5 : 0;
    q[a] = a == axis ? 0.5 : std::clamp(p[a], low, low + 0.5);
  }
  return q;
}

/// Whether a vertex stays where it was made: one that only keeps sheets apart (SurfaceNet::Home).
inline bool is_pinned(const SurfaceNet::Home& home) {
  return std::popcount(home.edges) < 3;
}

/// Back to within reach of the vertex's squares, and of its cell's middle along each axis.
inline Eigen::Vector3d hold(const Eigen::Vector3d& at, const SurfaceNet::Home& home) {
  const double reach = home.alone != 0 ? kReach : kReachBeside;
  const Eigen::Vector3d origin(home.cell[0], home.cell[1], home.cell[2]);
  const Eigen::Vector3d p = (at - origin).cwiseMax(0.5 - kReach).cwiseMin(0.5 + kReach);
  Eigen::Vector3d nearest = p;
  double best = 1e300;
  for (int e = 0; e < 12; ++e) {
    if ((home.edges >> e & 1) == 0) continue;
    const Eigen::Vector3d q = on_square(p, e);
    const double d = (p - q).squaredNorm();
    if (d < best) {
      best = d;
      nearest = q;
    }
    if (d == 0) break;
  }
  if (best <= reach * reach) return origin + p;
  return origin + nearest + (p - nearest) * (reach / std::sqrt(best));
}

}  // namespace ecorche::label_surfaces
