// SPDX-License-Identifier: Apache-2.0
#include "core/platform/signals.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

namespace ecorche::platform {
namespace {

int ends[2];          // of a pipe: written by the handler, read by the waiting thread
pid_t handler_owner;  // a forked child inherits the handler, not the right to write

// A terminal that is gone, as the kernel tells, ends the process; who sends SIGHUP asks for something.
extern "C" void tell(int signal, siginfo_t* info, void*) {
  const int saved = errno;
  if (getpid() == handler_owner) {
    const bool asked = signal == SIGHUP && info->si_code != SI_KERNEL;
    const char byte = static_cast<char>(asked ? Signal::hangup : Signal::stop);
    [[maybe_unused]] const auto ignored = write(ends[1], &byte, 1);
  }
  errno = saved;
}

void handle(int signal) {
  struct sigaction old {};
  sigaction(signal, nullptr, &old);
  if (old.sa_handler == SIG_IGN) return;  // nohup and background jobs asked for that
  struct sigaction action {};
  action.sa_sigaction = tell;
  action.sa_flags = SA_RESTART | SA_SIGINFO;
  sigaction(signal, &action, nullptr);
}

}  // namespace

bool catch_stops() {
  if (pipe2(ends, O_CLOEXEC) != 0) return false;
  handler_owner = getpid();
  handle(SIGINT);
  handle(SIGTERM);
  return true;
}

void catch_hangups() {
  if (handler_owner != 0) handle(SIGHUP);
}

bool wait_for_signal(Signal& which) {
  char byte = 0;
  ssize_t got = 0;
  do {
    got = read(ends[0], &byte, 1);
  } while (got < 0 && errno == EINTR);
  which = static_cast<Signal>(byte);
  return got == 1;
}

void end_process(int code) {
  _exit(code);
}

}  // namespace ecorche::platform
