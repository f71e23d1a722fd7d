// SPDX-License-Identifier: Apache-2.0
#include "app/signals.hpp"

#include <unistd.h>
#include <csignal>
#include <thread>

namespace ecorche::app {

std::stop_token stop_on_signals() {
  static std::stop_source source;
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // Lives as long as the process: nothing waits for it.
  std::thread([signals] {
    int signal = 0;
    if (sigwait(&signals, &signal) == 0) source.request_stop();
    if (sigwait(&signals, &signal) == 0) _exit(130);
  }).detach();
  return source.get_token();
}

}  // namespace ecorche::app
