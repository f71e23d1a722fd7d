// SPDX-License-Identifier: Apache-2.0
// Work that is over before another thread has woken.
#pragma once

#include <tbb/task_arena.h>

#include <utility>

namespace ecorche::server {

/// Runs `work` on the calling thread alone, whatever it holds of TBB's loops.
template <class Work>
void serially(Work&& work) {
  thread_local tbb::task_arena arena(1);
  arena.execute(std::forward<Work>(work));
}

}  // namespace ecorche::server
