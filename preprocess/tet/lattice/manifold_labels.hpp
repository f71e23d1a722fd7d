// SPDX-License-Identifier: Apache-2.0
// Labelled tets, relabelled until the boundary of every material is a manifold.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>

namespace ecorche::tet {

/// Around every node the tets of each bone, of soft tissue, and of the body as a whole, and those that are
/// not, are one group each (joined by faces), so that every material's border is one loop there. First what
/// is enclosed is filled and loose ends become soft tissue, bones as well as outside; what then remains turns
/// soft with its whole neighbourhood. That only ever grows, so it ends. Labels are the voxelizer's; tets
/// outside (label 0) must be there wherever a node of the body is. Returns how many tets changed.
std::int64_t make_manifold(const std::vector<std::array<std::int32_t, 4>>& tets, std::size_t nodes,
                           std::vector<std::uint16_t>& label, const Context& context);

}  // namespace ecorche::tet
