// SPDX-License-Identifier: Apache-2.0
// A surface that meets itself.
#pragma once

#include <optional>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include "preprocess/check/surface_figures.hpp"

namespace ecorche::check {

/// Pairs of triangles that cross or touch beyond the corners and edges that they share; decided exactly.
/// Triangles without area are left out. `first`: the middle of what the boxes of the first pair share. Empty
/// in a build without GPL parts, which does not look. Throws Error{interrupted} only. O(#F log^3 #F + pairs).
std::optional<Offenders> self_intersections(const SurfaceMesh& mesh, const Context& context);

namespace cgal {
Offenders self_intersections(const SurfaceMesh& mesh, const Context& context);
}

}  // namespace ecorche::check
