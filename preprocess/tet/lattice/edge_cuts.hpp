// SPDX-License-Identifier: Apache-2.0
// Where edges of a lattice leave one material for another.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include "preprocess/tet/lattice/node_materials.hpp"

namespace ecorche::tet {

/// An edge between two materials, of nodes a < b.
struct LatticeEdge {
  std::int64_t a, b;
  double share = 0.5;       ///< 0 to 1: where it is cut, from a
  std::int32_t point = -1;  ///< of the mesh, there; -1: the edge is not cut any more
  bool operator<(const LatticeEdge& other) const { return a != other.a ? a < other.a : b < other.b; }
  bool operator==(const LatticeEdge& other) const { return a == other.a && b == other.b; }
};

/// Sets where the edges are cut: where the signed distance of the one surface between their ends is 0, that
/// of two bones is equal, or, from bone to outside, amid bone and skin where the skin is the outer one; all
/// taken as linear along the edge. Exact for planes. Where an end lies on the wrong side of its surface the
/// cut is at that end.
void place_on_surfaces(std::vector<LatticeEdge>& edges, const std::vector<std::uint16_t>& material,
                       const LatticeSurfaces& surfaces, const Context& context);

}  // namespace ecorche::tet
