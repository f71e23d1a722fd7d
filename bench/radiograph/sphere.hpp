// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ecorche::bench {

/// How far pictures of a sphere of water are off its chords, and how long they take: by Joseph82 as ecorche
/// traces, and by Siddon85 as Jacobs98 walks it, voxel by voxel, in doubles and one ray at a time.
void compare_on_a_sphere();

}  // namespace ecorche::bench
