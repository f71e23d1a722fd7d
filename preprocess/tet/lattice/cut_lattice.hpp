// SPDX-License-Identifier: Apache-2.0
// A lattice whose nodes lie on the surfaces where they are near, and whose tets are cut where they are not.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include "preprocess/tet/lattice/bcc_lattice.hpp"
#include "preprocess/tet/lattice/edge_cuts.hpp"
#include "preprocess/tet/lattice/node_materials.hpp"
#include "preprocess/tet/mesher.hpp"

namespace ecorche::tet {

/// What was done to keep every tet in one material.
struct CutReport {
  std::int64_t warped = 0;      ///< nodes moved to a surface
  std::int64_t cut = 0;         ///< edges cut
  std::int64_t stars = 0;       ///< tets where three materials or more meet
  std::int64_t large = 0;       ///< tets larger than the lattice's
  std::int64_t lent = 0;        ///< nodes given to parts thinner than the lattice
  double largest_misfit = 0;    ///< of a tet's volume, by which its pieces' differ: rounding
  std::int64_t relabelled = 0;  ///< tets relabelled, so that boundaries are manifolds
};

struct CutMesh {
  TetMesh mesh;
  CutReport report;
};

/// Sets `share` of every edge, given the material of every node.
using PlaceCuts = std::function<void(std::vector<LatticeEdge>&, const std::vector<std::uint16_t>&)>;

/// Isosurface stuffing (LabelleShewchuk07) of several materials. A node whose tets see two materials moves to
/// the interface where an edge of it is cut nearer than 0.25 (long edges) or 0.41 (short ones) of its length.
/// A node stays where it is if its tets see three or more, if it was lent to a thin part, or if it has such
/// cuts on opposite sides; its edges are then cut no nearer to it than that. Tets are split (split_tet.hpp)
/// and relabelled (manifold_labels.hpp); within a material they are twice
/// as large (grade.hpp). Found over random materials and cuts: no dihedral angle below 8
/// degrees, nor below 5 where three materials meet. Six cubes all round must be outside, their number along
/// each axis even.
CutMesh cut_lattice(const BccLattice& lattice, NodeMaterials materials, const PlaceCuts& place_cuts,
                    const Context& context);

/// Of skin and bones, cut by `place_on_surfaces`.
CutMesh cut_lattice(const BccLattice& lattice, const Input& input, const Context& context);

}  // namespace ecorche::tet
