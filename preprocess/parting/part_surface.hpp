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
struct Seam {
  int part = -1;  ///< the side
  std::vector<std::array<std::int32_t, 2>> edges;
};

/// Lets each triangle of a bound tissue go with one side of the cuts. Vertices within 2.5 cubes of a cut are
/// given a side anew, so that borders are short, run along creases, and do not follow the tets' corners: the
/// cheapest cut of the surface. Vertices that both sides need are doubled, the copies last, bound to tets of
/// their own side. Returns what borders came of it; nothing changes where no triangle crosses a cut.
std::vector<Seam> part_surface(Tissue& tissue, const PartedTets& tets, const Context& context);

/// Closes both sides of the cuts where they lie in the body, with the cut itself, smoothed, between the seams
/// of the skin. The first `given` of its vertices are the case's own: they stay.
void close_seams(Tissue& skin, const std::vector<Seam>& seams, Eigen::Index given, const PartedTets& tets,
                 const Context& context);

}  // namespace ecorche::parting
