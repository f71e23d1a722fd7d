// SPDX-License-Identifier: Apache-2.0
#include "app/abandonable.hpp"

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <thread>
#include <utility>

#include <ecorche/values/context.hpp>

namespace ecorche::app {
namespace {

std::atomic<bool> abandoned{false};

}  // namespace

void run_abandonable(std::function<void()> work, const std::stop_token& stop) {
  std::packaged_task<void()> task(std::move(work));
  std::future<void> done = task.get_future();
  std::thread(std::move(task)).detach();
  Context asked;
  asked.stop = stop;
  while (done.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
    if (!stop.stop_requested()) continue;
    abandoned = true;
    asked.check_stop();
  }
  done.get();
}

int leave(int code) {
  if (!abandoned) return code;
  std::fflush(nullptr);
  std::_Exit(code);
}

}  // namespace ecorche::app
