// SPDX-License-Identifier: Apache-2.0
#include "app/signals.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <thread>

namespace ecorche::app {
namespace {

int bell[2];  // a pipe: written by the handler, read by the waiting thread
pid_t owner;  // a forked child inherits the handler, not the right to ring

extern "C" void ring(int) {
  const int saved = errno;
  if (getpid() == owner) {
    const char byte = 0;
    [[maybe_unused]] const auto ignored = write(bell[1], &byte, 1);
  }
  errno = saved;
}

// Waits for the next signal.
bool heard() {
  char byte;
  ssize_t got = 0;
  do {
    got = read(bell[0], &byte, 1);
  } while (got < 0 && errno == EINTR);
  return got == 1;
}

}  // namespace

std::stop_token stop_on_signals() {
  static std::stop_source source;
  owner = getpid();
  if (pipe2(bell, O_CLOEXEC) != 0) return source.get_token();  // signals then end the process at once
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction old {};
    sigaction(signal, nullptr, &old);
    if (old.sa_handler == SIG_IGN) continue;  // nohup and background jobs asked for that
    struct sigaction action {};
    action.sa_handler = ring;
    action.sa_flags = SA_RESTART;
    sigaction(signal, &action, nullptr);
  }
  // Lives as long as the process: nothing waits for it.
  std::thread([] {
    if (heard()) source.request_stop();
    if (heard()) _exit(130);
  }).detach();
  return source.get_token();
}

}  // namespace ecorche::app
