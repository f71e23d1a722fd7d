// SPDX-License-Identifier: Apache-2.0
// Connected parts of a tet mesh; a part without any bone has no weights of its own and follows its nearest
// neighbour.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::weights {

struct Parts {
  std::vector<std::int32_t> of_node;  ///< #nodes, 0 .. count - 1, numbered by their first node
  std::int32_t count = 0;
};

/// Nodes that share a tet are in one part. Nearly linear.
Parts connected_parts(Eigen::Index nodes, const Tets& T);

/// For every node of a part without a bone, the node whose weights it takes: the nearest one of the boned
/// part that comes nearest to its part. -1 for all other nodes. A warning names each such part. `boned` is by
/// part.
std::vector<std::int32_t> attachments(const Points& V, const Parts& parts,
                                      const std::vector<std::uint8_t>& boned, const Context& context);

}  // namespace ecorche::weights
