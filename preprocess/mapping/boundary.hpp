// SPDX-License-Identifier: Apache-2.0
// The faces of a tet mesh that only one tet has.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::mapping {

struct BoundaryFace {
  std::array<std::int32_t, 3> node;  ///< ascending
  std::int32_t tet;                  ///< the tet behind
};

/// Sorted by node. O(#T); the same for any number of threads.
std::vector<BoundaryFace> boundary_faces(std::int64_t nodes, const Tets& tets);

}  // namespace ecorche::mapping
