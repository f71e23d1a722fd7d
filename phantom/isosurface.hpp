// SPDX-License-Identifier: Apache-2.0
// The surface of a solid as a closed triangle mesh.
#pragma once

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include "phantom/shape.hpp"

namespace ecorche::phantom {

/// The surface of `shape`, sampled on a cubic lattice of `spacing` mm: about 1.5 vertices per spacing^2 of
/// area.
///
/// Surface nets (Gibson 1998) made manifold: samples are first filled in until no lattice square has its
/// inside corners on a diagonal. Then each cell face is crossed at most once, so that every cell holds whole
/// sheets of surface, one vertex each; two vertices share at most one edge, and each edge has exactly two
/// quads: closed and manifold by construction. Vertices slide along the surface towards their neighbours'
/// mean and are put back on it by Newton steps, never leaving the neighbourhood of their cell. Triangles run
/// counter-clockwise seen from outside. Features thinner than about 1.7 spacings may vanish. Same bytes for
/// any number of threads. Throws Error{internal} when the shape has no surface on the lattice.
SurfaceMesh isosurface(const Shape& shape, double spacing, const Context& context);

}  // namespace ecorche::phantom
