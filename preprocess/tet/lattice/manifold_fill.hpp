// SPDX-License-Identifier: Apache-2.0
// A clipped lattice whose boundary is a manifold.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include "preprocess/tet/lattice/bcc_lattice.hpp"

namespace ecorche::tet {

/// Adds tets until the boundary of the kept ones is a manifold: around every node, kept and missing tets are
/// one group each (joined by faces), so that their border on the sphere of 24 tets is one loop. Where the
/// kept ones are one group, all groups of missing ones but the largest are filled; else the whole star is.
/// Only adds, so it ends. `kept`: slot_count entries, 0 missing; tets added get `fill`. Returns how many were
/// added.
std::int64_t fill_to_manifold(const BccLattice& lattice, std::vector<std::uint16_t>& kept, std::uint16_t fill,
                              const Context& context);

}  // namespace ecorche::tet
