// SPDX-License-Identifier: Apache-2.0
// A skeleton for bones of which nobody said how they hang together.
#pragma once

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>

namespace ecorche::rig {

/// The segments that the case's bones name, joined where their surfaces are nearest to each other: the
/// minimum spanning tree of the gaps (Kruskal), hung from the segment that leaves the smallest largest part
/// when it is taken out (sizes are those of the bones' boxes). Every joint is a ball without limits, named
/// like its segment, with the axes of LPS; the root is free. Its centre is that of the sphere through the
/// surface that faces its parent, where that is a good one; else midway between the
/// two facing surfaces.
Skeleton generic_tree(const Case& patient, const Context& context);

}  // namespace ecorche::rig
