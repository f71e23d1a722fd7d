// SPDX-License-Identifier: Apache-2.0
#include "core/solve/abandonable.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

namespace ecorche::solve {
namespace {

/// From now on the process ends without running the destructors of libraries: OpenBLAS' takes the buffers
/// away from under the abandoned thread, and the process would die of it instead of leaving with its exit
/// code.
void leave_at_once_at_exit() {
  static std::once_flag once;
  std::call_once(once, [] {
    on_exit(
        [](int status, void*) {
          std::fflush(nullptr);
          std::_Exit(status);
        },
        nullptr);
  });
}

}  // namespace

void run_abandonable(std::function<void()> work, const Context& context) {
  context.check_stop();
  if (!context.stop.stop_possible()) {
    work();
    return;
  }
  std::packaged_task<void()> task(std::move(work));
  std::future<void> done = task.get_future();
  std::thread(std::move(task)).detach();
  while (done.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
    if (context.stop.stop_requested()) leave_at_once_at_exit();
    context.check_stop();
  }
  done.get();
}

}  // namespace ecorche::solve
