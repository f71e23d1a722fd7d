// SPDX-License-Identifier: Apache-2.0
// Surfaces of a body whose limbs came apart: each triangle goes with one side, and the skin closes both.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>
#include "preprocess/parting/parted_tets.hpp"

namespace ecorche::parting {

/// The border that a tissue got on one side of a contact: its edges, each as the triangle beside it turns.
struct CutRim {
  int part = -1;  ///< the side
  std::vector<std::array<std::int32_t, 2>> edges;
};

/// Lets each triangle of a bound tissue go with one side of the cuts (SurfaceSides): those across a border
/// are split there, with vertices for each side, which come last, and one for both where the border ends. Its
/// own vertices stay, bound to tets of their side. Returns the borders; nothing changes where no triangle
/// crosses.
std::vector<CutRim> part_surface(Tissue& tissue, const PartedTets& tets, const Context& context);

/// Closes both sides of the cuts where they lie in the body, with the cut itself, smoothed, between the rims
/// of the skin. The first `given` of its vertices are the case's own: they stay.
void close_cuts(Tissue& skin, const std::vector<CutRim>& cuts, Eigen::Index given, const PartedTets& tets,
                const Context& context);

}  // namespace ecorche::parting
