// SPDX-License-Identifier: Apache-2.0
// The tets to look at when a mesh or its weights are refused.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <ecorche/values/error.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::preprocess {

/// Some tets of a mesh on nodes of their own, worst first, with what is wrong with each.
struct WorstTets {
  PointsF V;                                   ///< #V by 3, mm
  Tets T;                                      ///< #T by 4, rows of V
  std::vector<std::uint16_t> label;            ///< #T
  std::vector<std::int32_t> tet;               ///< #T, its row in the mesh
  std::vector<float> least_deg, greatest_deg;  ///< #T, dihedral angles; 0 and 180 of a flat tet
  std::vector<float> volume_mm3;               ///< #T, negative of an inverted one
};

/// At most `most` tets: inverted and flat ones first, then by their largest dihedral angle (an obtuse one
/// makes the Laplacian's off-diagonal of its opposite edge positive, and that is what lets weights leave
/// [0, 1]), ties to the lower row. O(#T).
WorstTets worst_tets(const TetMesh& mesh, std::size_t most = 1000);

/// `refusal`, with what `show(worst tets)` returns before its advice: where to look. As it is where no
/// dihedral angle of the mesh is to blame: where all are below 165 degrees, as tet/relax_slivers leaves them.
Error blaming_worst_tets(const Error& refusal, const TetMesh& mesh,
                         const std::function<std::string(const WorstTets&)>& show);

}  // namespace ecorche::preprocess
