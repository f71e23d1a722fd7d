// SPDX-License-Identifier: Apache-2.0
// Targeted volume morphing (Gagvani01 6): the balls of one object become those of another.
#pragma once

#include <ecorche/runtime/resample.hpp>
#include <ecorche/values/context.hpp>
#include "runtime/spheres/owners.hpp"

namespace ecorche::runtime {

/// One of the two objects: its balls, where they are now, and its values.
struct MorphSide {
  const BallSet& balls;
  const Image& volume;
};

/// At `time` in [0, 1] between `from` and `to`, on the lattice of `from`: every ball of `from` is paired with
/// the ball of `to` whose place in its object's box is nearest, and every ball of `to` with one of `from`
/// likewise, so that none is left out. A pair's ball has its centre and radius on the line between the two,
/// owns voxels as ever, and shows (1 - time) of the one volume and `time` of the other, each at the same way
/// from its own ball's centre (no farther than its rim). So time 0 is `from` refilled, and 1 is `to`. Label
/// volumes (`nearest`) change over at 1/2.
/// Throws Error{usage} where the volumes differ in type or components or a time is out of range; Error{data}
/// where one has no balls. O(balls * log balls).
Image morph(const MorphSide& from, const MorphSide& to, double time, double background, Sampling sampling,
            const Context& context = {});

}  // namespace ecorche::runtime
