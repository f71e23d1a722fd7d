// SPDX-License-Identifier: Apache-2.0
// The threads that make volumes, below all others.
#pragma once

#include <tbb/task_arena.h>

#include "runtime/server/schedule/workers.hpp"

namespace ecorche::server {

/// They give way to whoever makes a frame of a mesh. A volume is worth many threads: those of TBB help where
/// no other arena has work for them.
class VolumeWorkers {
 public:
  explicit VolumeWorkers(int threads)
      : below_(threads, 1, tbb::task_arena::priority::low),
        workers_(threads, [this](const Job& job) { giving_way([&] { below_.execute(job); }); }) {}

  Workers& workers() { return workers_; }

 private:
  tbb::task_arena below_;
  Workers workers_;
};

}  // namespace ecorche::server
