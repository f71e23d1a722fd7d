// SPDX-License-Identifier: Apache-2.0
// Folds of a posed body, undone: where skinning turned tets inside out, their free nodes move until none is.
#pragma once

#include <cstdint>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

struct Unfolding {
  std::uint64_t inverted_before = 0, inverted_after = 0;  ///< tets of the body
  double rest_mm3_before = 0, rest_mm3_after = 0;         ///< what they hold at rest
  std::uint64_t held = 0;  ///< of those after: all four corners lie on bones, which overlap there
  std::uint64_t moved_nodes = 0;
  double largest_move_mm = 0;
};

/// Moves nodes of `body` near inverted tets, and the vertices that hang on them; segments and bones stay.
/// Nodes that touch a bone are held, so what two bones squeeze between them stays inverted. A patch of so
/// many rings of nodes about the folds relaxes by FoldEnergy (its outer nodes are held too), first a narrow
/// one, then wider ones about what is left; the rest of the body keeps its nodes. What closed tissues enclose
/// is held (PatchVolumes): none comes out farther from its rest volume than skinning had put it, by more than
/// 1e-3 of it; a patch that would is taken back. A frame alone decides:
/// nothing joins it to the frame before, and it takes seconds, so it is for posing offline. Skinning that
/// folds nothing is left as it is, to the last bit.
Unfolding unfold(const Model& model, PosedBody& body, const Context& context);

}  // namespace ecorche::runtime
