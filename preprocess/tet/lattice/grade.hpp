// SPDX-License-Identifier: Apache-2.0
// Tets twice as large where nothing happens.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "preprocess/tet/lattice/bcc_lattice.hpp"

namespace ecorche::tet {

using LatticeTet = std::array<std::int64_t, 4>;

/// What fills a lattice: some of its own tets, and larger ones between nodes of it.
struct Graded {
  std::vector<LatticeTet> fine, large;
};

/// Which nodes may lose the tets around them, told by the caller.
class Quiet {
 public:
  virtual ~Quiet() = default;
  /// Whether all tets at the node are of one material and none of them is cut or moved.
  virtual bool quiet(std::int64_t node) const = 0;
  virtual std::uint16_t material(std::int64_t node) const = 0;
};

/// The lattice of twice the side has this one's tets as the eight pieces of its own, by the middles of their
/// edges (the body-centred cubic tet is the one that falls into copies of itself). Pieces are joined where
/// the ten nodes of all eight are quiet and of one material. A large tet beside smaller ones is cut through
/// the middles that they share: through one face, or by halving split edges, longest first; where more is
/// split it falls into its pieces again (red-green refinement, Molino et al. 2003). Dihedral angles of large
/// tets: 30 to 135 degrees; some off-diagonals of the Laplacian are positive there: uncut
/// lattices are graded by octree.hpp. The lattice must have an even number of cubes along each axis.
Graded grade(const BccLattice& lattice, const Quiet& quiet);

}  // namespace ecorche::tet
