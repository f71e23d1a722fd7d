// SPDX-License-Identifier: Apache-2.0
// Tissues after nodes of a posed body were moved by something else than skinning.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// Vertices that hang on tets with a moved node, `moved` #nodes, again where their tets are. Bones stay, and
/// so do tissues of which `body` has no positions.
void carry_tissues(const Model& model, const std::vector<std::uint8_t>& moved, PosedBody& body);

}  // namespace ecorche::runtime
