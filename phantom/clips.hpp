// SPDX-License-Identifier: Apache-2.0
// Motion clips of the phantom, on joints named as in CMU's BVH files.
#pragma once

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::phantom {

/// Two strides on the spot, 2.4 s at 30 frames per second; the frame after the last is the first.
Clip make_walk(const Skeleton& truth);

/// Bends forward and reaches down with the head turned, knees giving, feet on their places; and back up. 4 s,
/// looping.
Clip make_bend(const Skeleton& truth);

}  // namespace ecorche::phantom
