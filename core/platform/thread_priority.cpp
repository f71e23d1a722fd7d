// SPDX-License-Identifier: Apache-2.0
#include "core/platform/thread_priority.hpp"

#ifdef __linux__
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace ecorche::platform {

bool set_thread_priority([[maybe_unused]] Priority priority) {
#ifdef __linux__
  switch (priority) {
    case Priority::low: {
      constexpr int kNice = 10;  // on Linux a thread may have one of its own; anybody may lower it
      return setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice) == 0;
    }
    case Priority::idle: {
      constexpr sched_param kNone{};
      return sched_setscheduler(0, SCHED_IDLE, &kNone) == 0;
    }
    case Priority::real_time: {
      constexpr sched_param kLeast{.sched_priority = 1};
      return sched_setscheduler(0, SCHED_RR | SCHED_RESET_ON_FORK, &kLeast) == 0;
    }
  }
#endif
  return false;
}

}  // namespace ecorche::platform
