// SPDX-License-Identifier: Apache-2.0
// Piecewise linear complexes: what TetGen fills.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::tet {

/// Triangles over shared vertices, each once; no two of them may cross. Between them lie regions.
struct Complex {
  struct Seed {
    std::array<double, 3> point;  ///< strictly inside a region
    std::uint16_t label;          ///< of its tets, as in TetMesh
  };
  std::vector<double> points;  ///< 3 a vertex, mm
  std::vector<std::array<int, 3>> triangles;
  std::vector<Seed> seeds;  ///< one a region; or none where nobody knows the regions
  double speck = 0;         ///< mm^3 that a hollow of a lattice has by chance: one cube
  std::size_t vertices() const { return points.size() / 3; }
};

/// Skin and bones as they are; vertices at equal places are one.
Complex complex_of_surfaces(const Case& patient);

/// The faces between tets of different labels, and those of the boundary, with nodes on them moved towards
/// the mean of their neighbours on the surface. `mesh` must be a piece of a body-centred cubic lattice of
/// cubes of `side`: its tets are 0.7 side high and no node moves by more than 0.2 side, so that none turns
/// over and no two faces cross.
Complex complex_of_lattice(const TetMesh& mesh, double side);

/// What became of regions without a seed: hollows that the tets of the complex went round.
struct Hollows {
  std::size_t filled = 0, left = 0;
};

/// Labels the tets between the triangles. `regions`: 1 + the seed's label for each tet whose region has a
/// seed, any higher number of its own for one without. Such a hollow takes the label of the bone that it lies
/// in where it touches nothing else; elsewhere it becomes soft tissue where it is a speck, and its tets go
/// where it is larger: the skin has an inside there that is not of the body.
Hollows label_by_seeds(TetMesh& mesh, const std::vector<int>& regions, const Complex& complex);

}  // namespace ecorche::tet
