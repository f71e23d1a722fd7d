// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/schedule/workers.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <string>

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

// Whoever had less comes first, of the wholes and of their parts; those on nobody's account before.
TEST(Workers, TakeTurnsByWhatEachHad) {
  std::string order;
  {
    std::mutex mutex;
    mutex.lock();
    Workers workers(1, [](const Job& job) { job(); });
    const auto wait = [&] { const std::lock_guard lock(mutex); };
    const auto busy = std::make_shared<Account>(), other = std::make_shared<Account>();
    const auto first = std::make_shared<Account>(busy), second = std::make_shared<Account>(busy),
               newcomer = std::make_shared<Account>(other);
    first->use(2);
    second->use(1);
    const auto submit = [&](char name, const std::shared_ptr<Account>& by) {
      workers.submit([&, name] { order += name; }, by);
    };
    workers.submit(wait);
    submit('a', first);
    submit('b', second);
    submit('c', first);
    submit('d', newcomer);
    submit('e', nullptr);
    mutex.unlock();
    workers.drain();
    EXPECT_EQ(order, "edbac");
    // Who comes again has no more to get than those who stayed.
    const auto late = std::make_shared<Account>();
    workers.submit([] {}, late);
    EXPECT_GE(late->used().second, 1.0);
    workers.drain();
  }
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
