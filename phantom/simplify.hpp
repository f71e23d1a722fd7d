// SPDX-License-Identifier: Apache-2.0
// Fewer triangles for the same surface.
#pragma once

#include <ecorche/values/mesh.hpp>

namespace ecorche::phantom {

/// Collapses edges of the closed manifold `mesh` until at most `vertices` are left, cheapest quadric error
/// first (Garland & Heckbert 1997). The result is closed and manifold with the same genus: an edge is
/// collapsed only when its ends share exactly two neighbours, and when no triangle turns by more than 60
/// degrees or becomes a sliver. Stops early where no such edge is left. Deterministic.
SurfaceMesh simplify(const SurfaceMesh& mesh, int vertices);

}  // namespace ecorche::phantom
