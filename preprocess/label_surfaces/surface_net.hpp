// SPDX-License-Identifier: Apache-2.0
// The surface of a mask as a net of vertices, one or more to every cell that it passes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include "preprocess/label_surfaces/mask.hpp"

namespace ecorche::label_surfaces {

/// Vertices in the mask's index space, and what each may do there.
struct SurfaceNet {
  /// A vertex lies by the squares in which its loop crosses the voxels' faces: three or more for the vertex
  /// of a loop, two for one on the face between two cells, one for the hub of a fan; those two kinds stay.
  struct Home {
    std::array<std::int32_t, 3> cell;  ///< its first corner
    std::uint16_t edges;               ///< crossed edges of the cell, one bit each (net_cells.hpp)
    std::uint16_t alone;               ///< 1 where no other loop passes the cell
  };
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Home> homes;
  std::vector<std::array<std::int32_t, 4>> quads;      ///< counter-clockwise seen from outside, right-handed
  std::vector<std::array<std::int32_t, 3>> triangles;  ///< fans of what is no quad
};

/// Surface nets (Gibson 1998), in the dual form of marching cubes (Nielson 2004): one vertex per loop of
/// surface in a cell, one quad round each pair of neighbouring voxels of which one is inside. Where two loops
/// of two cells would share two edges, those get a vertex of their own in the middle and the quads about them
/// are cut into fans, so that the net is closed and manifold whatever the mask. O(cells).
SurfaceNet make_net(const Mask& mask, const Context& context);

/// Low-pass filters the net (Taubin, Zhang and Golub 1996: a windowed sinc), every vertex within 0.45 voxels
/// of its squares, and of its cell's middle along each axis. O(vertices * passes).
void smooth(SurfaceNet& net, const Context& context);

/// Moves every connected piece of the net along its normals until it holds as much as its voxels do, as far
/// as the same bounds allow. O(vertices).
void restore_volume(SurfaceNet& net);

/// As a mesh in the mask's index space.
SurfaceMesh triangulate(const SurfaceNet& net);

}  // namespace ecorche::label_surfaces
