// SPDX-License-Identifier: Apache-2.0
// Tets as Gmsh, TetGen, Abaqus and MCNP read them: bytes of a whole file. Every encoder takes what
// `check_tets` passed.
#pragma once

#include <string>

#include <ecorche/values/mesh.hpp>
#include "io/surface/surface_file.hpp"

namespace ecorche::io::tet_formats {

/// Below these MCNP loses particles in an element, and meshers call it degenerate.
inline constexpr double least_volume_mm3 = 1e-3;
inline constexpr double least_dihedral_deg = 0.5;

/// Throws Error{internal} for a corner that is no node, and for a label without a name.
void check_tets(const PointsF& V, const Tets& T, const TetRegions& regions);

/// Throws Error{refused} naming `where` when a tet has less than `least_volume_mm3` (an inverted one has a
/// negative volume) or a dihedral angle below `least_dihedral_deg`: how many, and the first ten with node
/// numbers (from 1), volume, angle and centre.
void refuse_degenerate(const PointsF& V, const Tets& T, const std::string& where);

/// Gmsh MSH 2.2, binary: regions are physical volumes `label + 1` with their names; mm.
std::string encode_msh(const PointsF& V, const Tets& T, const TetRegions& regions);

/// TetGen `.node` and `.ele`, counted from 1; the region's label is the one attribute of a tet, its name a
/// comment; mm.
std::string encode_node(const PointsF& V);
std::string encode_ele(const Tets& T, const TetRegions& regions);

/// Abaqus `.inp`: nodes, C3D4 elements, an element set a region under its name (`r_` before a digit); mm.
std::string encode_abaqus(const PointsF& V, const Tets& T, const TetRegions& regions);

/// Abaqus as MCNP6's unstructured mesh wants it (LA-UR-17-22442): one part and its instance, element sets
/// `Set-material_tally_001`, ... one a region that occurs, numbered in the order of labels, a solid section
/// and a material `Material-<name>_001` for each; centimetres, MCNP's unit.
std::string encode_mcnp(const PointsF& V, const Tets& T, const TetRegions& regions);

}  // namespace ecorche::io::tet_formats
