// SPDX-License-Identifier: Apache-2.0
// The threads of a server by what they do, without a server.
#include "runtime/server/schedule/executor.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#ifdef __linux__
#include <sched.h>
#include <sys/resource.h>
#endif

namespace ecorche::server {
namespace {

constexpr std::array kServices{Service::frames,  Service::volumes,    Service::planes,
                               Service::quality, Service::background, Service::first_frames,
                               Service::levels,  Service::disposal,   Service::files};

struct Threads {
  net::io_context io;
  Workers frames{2, [](const Job& job) { job(); }};
  Executor executor{io, frames};
};

// Whatever a job holds ends on the I/O thread, however late, and that waits for it.
TEST(Executor, TellsTheIoThreadWhereAllEnds) {
  for (const Service service : kServices) {
    SCOPED_TRACE(static_cast<int>(service));
    Threads threads;
    const auto here = std::this_thread::get_id();
    std::thread::id worked, told;
    std::vector<std::thread::id> ended;
    const auto held = [&] {
      return std::shared_ptr<int>(new int(0), [&](const int* number) {
        delete number;
        ended.push_back(std::this_thread::get_id());
      });
    };
    threads.executor.run(
        service,
        [&, what = held()] {
          std::this_thread::sleep_for(std::chrono::milliseconds(5));
          worked = std::this_thread::get_id();
        },
        [&, what = held()] { told = std::this_thread::get_id(); });
    threads.io.run();
    EXPECT_NE(worked, here);
    EXPECT_NE(worked, std::thread::id());
    EXPECT_EQ(told, here);
    EXPECT_EQ(ended, (std::vector<std::thread::id>{here, here}));
  }
}

TEST(Executor, FinishesWhatWasSubmitted) {
  std::atomic<std::size_t> done = 0;
  {
    Threads threads;
    for (int i = 0; i < 20; ++i) {
      for (const Service service : kServices) threads.executor.submit(service, [&] { ++done; });
    }
    threads.executor.drain(Service::files);
    EXPECT_GE(done, 20U);
  }
  EXPECT_EQ(done, 20 * kServices.size());
}

// Requests wait for each other, whoever had least first, and never for a thread that a pose could have.
TEST(Executor, ServesRequestsInTurnsBesidePoses) {
  Threads threads;
  const auto busy = std::make_shared<Account>(), idle = std::make_shared<Account>();
  busy->use(10);
  std::mutex mutex;
  mutex.lock();
  std::string order;
  std::atomic<bool> posed = false;
  const auto request = [&](char name, const std::shared_ptr<Account>& by) {
    threads.executor.run_request([&] { const std::lock_guard wait(mutex); }, [&, name] { order += name; },
                                 by);
  };
  request('a', busy);
  request('b', busy);
  request('c', idle);
  request('d', nullptr);
  threads.executor.submit(Service::frames, [&] { posed = true; });
  for (int i = 0; i < 5000 && !posed; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(posed);
  mutex.unlock();
  threads.io.run();
  EXPECT_EQ(order, "adcb");
  EXPECT_GT(idle->used().second, 0) << "it pays for its time";
}

TEST(Executor, DestroysElsewhere) {
  Threads threads;
  std::thread::id ended;
  threads.executor.destroy_later(std::shared_ptr<int>(new int(0), [&](const int* number) {
    delete number;
    ended = std::this_thread::get_id();
  }));
  threads.executor.drain(Service::disposal);
  EXPECT_NE(ended, std::thread::id());
  EXPECT_NE(ended, std::this_thread::get_id());
}

TEST(Executor, LetsTestsHoldJobsBack) {
  net::io_context io;
  Workers frames(1, [](const Job& job) { job(); });
  std::vector<Service> seen;
  int done = 0;
  {
    Executor executor(io, frames, [&](Service service, const Job& job) {
      seen.push_back(service);
      job();
    });
    executor.submit(Service::planes, [&] { ++done; });
  }
  EXPECT_EQ(seen, std::vector<Service>{Service::planes});
  EXPECT_EQ(done, 1);
}

#ifdef __linux__
// All but the frames' own.
TEST(Executor, GivesWayToFrames) {
  const int own = getpriority(PRIO_PROCESS, 0);
  for (const Service service : kServices) {
    SCOPED_TRACE(static_cast<int>(service));
    Threads threads;
    int nice = 0, policy = -1;
    threads.executor.submit(service, [&] {
      nice = getpriority(PRIO_PROCESS, 0);
      policy = sched_getscheduler(0);
    });
    threads.executor.drain(service);
    EXPECT_EQ(policy == SCHED_IDLE, service == Service::quality);
    if (service == Service::frames) {
      EXPECT_EQ(nice, own);
    } else if (service != Service::quality) {
      EXPECT_TRUE(nice == 10 || (nice == own && own > 10)) << nice;
    }
  }
}
#endif

}  // namespace
}  // namespace ecorche::server
