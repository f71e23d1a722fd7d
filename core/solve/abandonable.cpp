// SPDX-License-Identifier: Apache-2.0
#include "core/solve/abandonable.hpp"

#include <chrono>
#include <future>
#include <thread>
#include <utility>

namespace ecorche::solve {

void run_abandonable(std::function<void()> work, const Context& context) {
  context.check_stop();
  if (!context.stop.stop_possible()) {
    work();
    return;
  }
  std::packaged_task<void()> task(std::move(work));
  std::future<void> done = task.get_future();
  std::thread(std::move(task)).detach();
  while (done.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) context.check_stop();
  done.get();
}

}  // namespace ecorche::solve
