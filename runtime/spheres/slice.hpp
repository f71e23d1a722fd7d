// SPDX-License-Identifier: Apache-2.0
// A plane through a posed volume, without the volume: pixels ask the balls themselves.
#pragma once

#include <ecorche/runtime/resample.hpp>
#include <ecorche/values/context.hpp>
#include "runtime/spheres/balls.hpp"

namespace ecorche::runtime {

/// The plane of `out`, whose grid lies anywhere with pixels of any edges and is one pixel thick. A pixel
/// belongs to the ball that owns its centre by the rule of tile_owners.hpp, asked at the centre itself, and
/// shows what refill() shows: where a pixel's centre is that of a voxel of set.lattice, they agree. `out`
/// has the volume's type and components. The same bytes for any number of threads. Throws as for_tiles.
void refill_slice(const BallSet& set, const Image& volume, double background, Sampling sampling, Image& out,
                  const Context& context = {});

}  // namespace ecorche::runtime
