// SPDX-License-Identifier: Apache-2.0
// Which threads of the machine go first.
#pragma once

#include <cstdint>

namespace ecorche::platform {

enum class Priority : std::uint8_t {
  low,   ///< behind the usual ones, though not last: whoever waits for a lock of this thread's waits less
  idle,  ///< last: a core that runs only such threads is an idle one to what wakes
  /// A usual one that runs 0.1 ms at a time, so that what runs in longer turns gives way to it once it wakes;
  /// threads that it starts are usual ones. From Linux 6.12 on, and anybody may.
  prompt,
  real_time  ///< before all usual ones; threads that it starts are usual ones
};

/// Of the calling thread. False where the system knows none or does not allow it: all stays as it was.
bool set_thread_priority(Priority priority);

}  // namespace ecorche::platform
