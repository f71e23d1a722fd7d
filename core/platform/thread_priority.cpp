// SPDX-License-Identifier: Apache-2.0
#include "core/platform/thread_priority.hpp"

#ifdef __linux__
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace ecorche::platform {
namespace {

#ifdef __linux__
// struct sched_attr of sched_setattr(2), which Debian 12's C library does not declare.
struct SchedulingAttributes {
  static constexpr std::uint64_t reset_on_fork = 1;

  std::uint32_t size = sizeof(SchedulingAttributes), policy = 0;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime = 0;  // ns of a turn
  std::uint64_t deadline = 0, period = 0;
};
#endif

}  // namespace

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
    case Priority::prompt: {
      // Its nice value, and a class that it was started in, stay.
      SchedulingAttributes attributes;
      if (syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) != 0) return false;
      if (attributes.policy != SCHED_OTHER) return false;
      attributes.flags |= SchedulingAttributes::reset_on_fork;
      attributes.runtime = 100'000;
      return syscall(SYS_sched_setattr, 0, &attributes, 0) == 0;
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
