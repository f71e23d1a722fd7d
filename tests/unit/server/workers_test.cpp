// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/workers.hpp"

#include <gtest/gtest.h>

#include <atomic>

#ifdef __linux__
#include <sched.h>
#include <sys/resource.h>
#endif

namespace ecorche::server {
namespace {

TEST(Workers, FinishWhatWasSubmitted) {
  std::atomic<int> done = 0, around = 0;
  {
    Workers workers(3, [&](const Job& job) {
      ++around;
      job();
    });
    for (int i = 0; i < 100; ++i) workers.submit([&] { ++done; });
    workers.drain();
    EXPECT_EQ(done, 100);
    for (int i = 0; i < 100; ++i) workers.submit([&] { ++done; });
  }
  EXPECT_EQ(done, 200);
  EXPECT_EQ(around, 200);
}

#ifdef __linux__
// Anybody may lower a thread, and only that thread is.
TEST(Workers, GiveWay) {
  int nice = 0, policy = -1;
  {
    Workers giving(1, giving_way), last(1, last_of_all);
    giving.submit([&] { nice = getpriority(PRIO_PROCESS, 0); });
    last.submit([&] { policy = sched_getscheduler(0); });
  }
  EXPECT_EQ(nice, std::max(10, getpriority(PRIO_PROCESS, 0)));
  EXPECT_EQ(policy, SCHED_IDLE);
  EXPECT_NE(sched_getscheduler(0), SCHED_IDLE);
}
#endif

}  // namespace
}  // namespace ecorche::server
