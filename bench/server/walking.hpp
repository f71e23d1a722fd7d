// SPDX-License-Identifier: Apache-2.0
// The motion that the benches send, and how figures are summed up.
#pragma once

#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::bench {

/// One stride a second at 1.3 m/s: hips, knees, ankles, shoulders, elbows and spine swing as in a gait.
Pose walking(const Rig& rig, double seconds);

/// The `share` quantile, nearest rank; NaN of none.
double quantile(std::vector<double> values, double share);

/// Of this process, all threads.
double cpu_seconds();

}  // namespace ecorche::bench
