// SPDX-License-Identifier: Apache-2.0
// Points between materials, moved to the surfaces that they stand for.
#pragma once

#include <cstdint>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::tet {

struct FitReport {
  std::int64_t points = 0;  ///< between materials
  std::int64_t moved = 0;
};

/// Moves points between materials so that the faces there lie on skin and bones in the sense of least
/// squares, their corners and middles taken: a face over a bend is as much inside as its corners are outside.
/// A face of a bone and soft tissue belongs to the bone, of two bones amid them, of a bone and the outside
/// half way to the skin, but no more than `reach` (mm) off the bone. A move goes as far as no tet gets a
/// dihedral angle below 10 or above 165 degrees by it, or a worse one than it had; points within a material
/// give way. Labels and tets stay. The same for any number of threads.
FitReport fit_points(TetMesh& mesh, const Case& patient, double reach, const Context& context);

}  // namespace ecorche::tet
