// SPDX-License-Identifier: Apache-2.0
// A lattice on places that single precision holds exactly.
#pragma once

#include "preprocess/tet/lattice/clipper.hpp"

namespace ecorche::tet {

/// The same tets, on a lattice whose corners and centres are multiples of a power of two and exact in
/// float32: right angles stay right, and the off-diagonals between centres stay 0. Its side changes by at
/// most 1 in 2^13, and no node of 800 cubes in a row moves by more than a twentieth of it. Where the body
/// lies so far from the origin that float32 is coarser than that, the lattice stays as it is: nodes are then
/// rounded one by one (tet::canonicalize), and those off-diagonals are about as large as the rounding is
/// beside a side.
Clipped on_float_places(Clipped clipped);

}  // namespace ecorche::tet
