// SPDX-License-Identifier: Apache-2.0
// Cubes of a lattice, joined eight by eight where nothing happens.
#pragma once

#include <cstdint>
#include <vector>

#include "preprocess/tet/lattice/clipper.hpp"

namespace ecorche::tet {

/// Leaves are cubes of 1, 2, 4, ... of the lattice's a side, aligned with its first. A cube is *quiet* where
/// the 24 tets about its centre are of one label. Eight quiet cubes of one label are joined; eight such ones
/// again where no smaller cube touches them: leaves that touch differ by a factor of two at most.
class Octree {
 public:
  static constexpr int most_levels = 4;  ///< the largest leaf: 2^4 cubes a side

  explicit Octree(const Clipped& clipped);

  /// The leaf that holds a cube has 2^level cubes a side.
  int level(const BccLattice::Cell& cube) const {
    return levels_[static_cast<std::size_t>(lattice_.cube(cube))];
  }
  /// How many of the lattice's cubes are in leaves of each level.
  std::vector<std::int64_t> cubes_by_level() const;

 private:
  const BccLattice& lattice_;
  std::vector<std::uint8_t> levels_;  // per cube
};

/// The tets of the leaves, labelled as TetMesh says; where all are of one cube they are those of `gather`,
/// and the faces between labels always are. Leaves' centres and corners are the nodes. Every face of two
/// leaves of one size spans tets with their centres, about the edges and halves of edges around it; corners
/// between two halved edges are cut off, a tet for each leaf. A face of smaller leaves makes two tets with
/// the large one's centre, and two with the small one's.
///
/// All tets are Delaunay (for every edge the circumcentres around it turn one way), so that finite volumes
/// have no positive off-diagonal (weights/harmonic.hpp); linear elements have. Isosurface stuffing
/// (LabelleShewchuk07) does not cut those corners, and is not Delaunay there. Dihedral angles: 35.2 to
/// 125.3 degrees.
TetMesh gather(const Clipped& clipped, const Octree& octree);

}  // namespace ecorche::tet
