// SPDX-License-Identifier: Apache-2.0
// Edges that float32 hardly resolves, made longer.
#pragma once

#include <cstdint>

#include <ecorche/values/mesh.hpp>

namespace ecorche::tet {

struct ShortEdges {
  std::int64_t before = 0, after = 0;   ///< edges below geometry::unresolved_edge, with room for rounding
  double shortest_mm = 0, then_mm = 0;  ///< of all edges
};

/// Delaunay refinement (cgal) may leave two nodes a few hundredths of a mm apart where others are a cm away:
/// the angles of their tets are good, yet in float32 their maps are noise. Where an edge is below the bound
/// its ends are parted along it to a few times the bound, hundredths of a mm, as far as all their tets keep a
/// positive volume and no angle becomes worse than it was or than 10 to 165 degrees. Edges in ascending order
/// of their nodes, so the result depends on the mesh alone. O(#T).
ShortEdges lengthen_short_edges(TetMesh& mesh);

}  // namespace ecorche::tet
