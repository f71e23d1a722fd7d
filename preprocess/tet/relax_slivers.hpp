// SPDX-License-Identifier: Apache-2.0
// Worst tets mended by moving their nodes a little.
#pragma once

#include <cstdint>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::tet {

struct SliverReport {
  std::int64_t before = 0;  ///< tets beyond the bounds
  std::int64_t after = 0;
  double largest_move_mm = 0;          ///< of any node
  double largest_surface_move_mm = 0;  ///< of a node of the skin or of a bone's surface
};

/// Dihedral angles that a tet should keep. Flatter tets break the bounds of harmonic weights.
struct SliverBounds {
  double min_deg = 10;
  double max_deg = 165;
};

/// Optimisation-based smoothing of the tets beyond `bounds`, worst first (Freitag & Ollivier-Gooch 1997):
/// each of their nodes tries steps in fixed directions and keeps one that raises the worst quality, 6 sqrt(2)
/// V / l_rms^3, among all tets around it. Connectivity and labels stay; no tet is ever inverted; a node of a
/// surface between labels moves by at most a quarter of its shortest edge in all, so that surfaces stay where
/// they were meshed. Deterministic.
SliverReport relax_slivers(TetMesh& mesh, const SliverBounds& bounds, const Context& context);

}  // namespace ecorche::tet
