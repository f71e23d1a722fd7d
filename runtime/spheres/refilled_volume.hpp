// SPDX-License-Identifier: Apache-2.0
// A volume kept refilled from pose to pose, beside PosedVolume, which is kept posed by tets.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/runtime/bricks.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>
#include "runtime/spheres/refill.hpp"

namespace ecorche::runtime {

/// For one subscriber. Others read `image`, `bricks` and `moved`, and touch nothing.
struct RefilledVolume {
  Image image;                      ///< of the last call's box
  Bricks bricks;                    ///< of that box
  std::vector<std::uint8_t> moved;  ///< a brick each: 1 where the last call made it again

  /// What `image` shows.
  struct Shown {
    const ModelVolume* volume = nullptr;  // null: nothing yet, or only half of it
    Sampling sampling = Sampling::trilinear;
    LatticeBox box;
    BallSet set;
  } shown;
};

/// refill() of the box into `kept.image`, byte for byte; but where `kept` shows the same `volume` (the same
/// object, unchanged) in the same box, only the bricks in which a ball came, went or turned are made again.
/// After an error the next call makes all. Throws as refill.
void follow(BallSet set, const LatticeBox& box, const ModelVolume& volume, Sampling sampling,
            RefilledVolume& kept, const Context& context = {});

}  // namespace ecorche::runtime
