// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/skin_nodes_lbs.hpp"

#include <tbb/parallel_for.h>

#include "runtime/skin/blend.hpp"

namespace ecorche::runtime {

void SkinNodesLbs::run() const {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, in.nodes(), nodes_per_task),
                    [this](const auto& nodes) {
                      for (std::size_t n = nodes.begin(); n < nodes.end(); ++n) {
                        const Vec3f moved = blend_displacements(in, n, about_origin(in, n));
                        carry_with_root(in.root, &in.rest[3 * n], moved, &posed[3 * n]);
                      }
                    });
}

}  // namespace ecorche::runtime
