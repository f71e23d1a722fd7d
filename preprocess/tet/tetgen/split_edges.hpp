// SPDX-License-Identifier: Apache-2.0
// Coarse surfaces made finer without moving them.
#pragma once

#include <cstddef>

#include "preprocess/tet/tetgen/complex.hpp"

namespace ecorche::tet {

/// Halves the longest edge, and every triangle at it, again and again until none is longer than `longest` mm
/// or there are `most` vertices (longest-edge bisection, Rivara 1984: no angle falls below half of the
/// smallest one at the start). The surfaces stay the same point sets. Ties go to the lower vertices, so the
/// result is deterministic. O(n log n).
void split_long_edges(Complex& complex, double longest, std::size_t most);

}  // namespace ecorche::tet
