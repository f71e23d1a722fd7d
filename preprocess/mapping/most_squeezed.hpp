// SPDX-License-Identifier: Apache-2.0
// Where points of a posed body came from, when all that is known of them is their place.
#pragma once

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>
#include "preprocess/mapping/bind.hpp"

namespace ecorche::mapping {

/// Gives the points of `binding` (of posed `points` in the posed tets) that several tets hold, or only
/// inverted ones, to the one that is squeezed most (TetGrid::most_squeezed): most of what lies there is from
/// it. The others keep theirs.
void bind_to_most_squeezed(const Points& points, const PointsF& rest, const PointsF& posed, const Tets& tets,
                           Binding& binding, const Context& context);

}  // namespace ecorche::mapping
