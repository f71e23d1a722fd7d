// SPDX-License-Identifier: Apache-2.0
// A posed volume by refilling the balls of its moved skeleton (Gagvani01 5): the second deformer.
#pragma once

#include <ecorche/runtime/resample.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include "runtime/spheres/owners.hpp"

namespace ecorche::runtime {

/// Every voxel of the box that some ball holds shows `volume` where the ball that owns it was at rest (see
/// BallSet, tile_owners.hpp); the others show `background`, as does what lies beyond the volume's own grid.
/// That grid need not be the lattice. Scalar type and components are kept; integers are rounded and
/// saturated (trilinear samples: sample_batch.hpp). At rest, on the volume's own grid, with every object
/// voxel kept, this is the object exactly.
///
/// The result is the same for any number of threads, and a box's is that part of the whole. Besides the
/// result and the volume it needs about 100 bytes a ball and 10 KiB a thread.
/// Throws as for_tiles.
Image refill(const BallSet& set, const LatticeBox& box, const Image& volume, double background,
             Sampling sampling, const Context& context = {});

/// The same into `out`, whose type and components must be the volume's and whose size that of the box: for
/// callers that keep their storage.
void refill_into(const BallSet& set, const LatticeBox& box, const Image& volume, double background,
                 Sampling sampling, Image& out, const Context& context = {});

/// The same of the bricks of `mask` alone, which are bricks of the box; the others keep what they show.
void refill_bricks(const BallSet& set, const LatticeBox& box, const Image& volume, double background,
                   Sampling sampling, const BrickMask& mask, Image& out, const Context& context = {});

}  // namespace ecorche::runtime
