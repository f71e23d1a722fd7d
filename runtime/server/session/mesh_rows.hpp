// SPDX-License-Identifier: Apache-2.0
// Parts of tissues: levels of detail, and what lies in a box.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <ecorche/values/model.hpp>
#include "runtime/spheres/pose_volume.hpp"

namespace ecorche::server {

/// The coarsest level of detail; 0 is the tissue itself.
inline constexpr std::uint32_t coarsest_level = 3;

/// Some vertices of a tissue, and the triangles between them.
struct MeshRows {
  std::vector<std::uint32_t> vertices;   ///< rows of Tissue::V, ascending
  std::vector<std::uint32_t> triangles;  ///< 3 per triangle, rows of `vertices`
};

/// One per tissue.
using MeshParts = std::vector<MeshRows>;

/// Levels 1 to `coarsest_level` of a tissue.
using MeshLevels = std::array<MeshRows, coarsest_level>;

/// Each has about a quarter of the triangles of the one before, by collapsing edges (meshoptimizer):
/// vertices only go, none moves. A tissue that cannot be made coarser keeps what it has.
MeshLevels make_levels(const Tissue& tissue);

/// Of `from` (null: the whole tissue) what lies in the box in the scan, both ends included; triangles with
/// all corners inside.
MeshRows cut(const Tissue& tissue, const MeshRows* from, const runtime::Region& box);

}  // namespace ecorche::server
