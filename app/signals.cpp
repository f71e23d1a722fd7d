// SPDX-License-Identifier: Apache-2.0
#include "app/signals.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <mutex>
#include <thread>
#include <utility>

namespace ecorche::app {
namespace {

enum class Rung : char { stop, hangup };

int bell[2];  // a pipe: written by the handler, read by the waiting thread
pid_t owner;  // a forked child inherits the handler, not the right to ring
std::mutex guard;
std::function<void()> on_hangup;

// A terminal that is gone, as the kernel tells, ends the process; who sends SIGHUP asks for something.
extern "C" void ring(int signal, siginfo_t* info, void*) {
  const int saved = errno;
  if (getpid() == owner) {
    const bool asked = signal == SIGHUP && info->si_code != SI_KERNEL;
    const char byte = static_cast<char>(asked ? Rung::hangup : Rung::stop);
    [[maybe_unused]] const auto ignored = write(bell[1], &byte, 1);
  }
  errno = saved;
}

// Waits for the next signal.
bool heard(Rung& which) {
  char byte = 0;
  ssize_t got = 0;
  do {
    got = read(bell[0], &byte, 1);
  } while (got < 0 && errno == EINTR);
  which = static_cast<Rung>(byte);
  return got == 1;
}

void ring_at(int signal) {
  struct sigaction old {};
  sigaction(signal, nullptr, &old);
  if (old.sa_handler == SIG_IGN) return;  // nohup and background jobs asked for that
  struct sigaction action {};
  action.sa_sigaction = ring;
  action.sa_flags = SA_RESTART | SA_SIGINFO;
  sigaction(signal, &action, nullptr);
}

void listen(std::stop_source& source) {
  Rung which{};
  bool again = false;
  while (heard(which)) {
    if (which == Rung::hangup) {
      const std::lock_guard lock(guard);
      if (on_hangup) on_hangup();
      continue;
    }
    if (std::exchange(again, true)) _exit(130);
    source.request_stop();
  }
}

}  // namespace

std::stop_token stop_on_signals() {
  static std::stop_source source;
  if (pipe2(bell, O_CLOEXEC) != 0) return source.get_token();  // signals then end the process at once
  owner = getpid();
  for (const int signal : {SIGINT, SIGTERM}) ring_at(signal);
  // Lives as long as the process: nothing waits for it.
  std::thread([] { listen(source); }).detach();
  return source.get_token();
}

OnHangup::OnHangup(std::function<void()> call) {
  const std::lock_guard lock(guard);
  on_hangup = std::move(call);
  if (owner != 0) ring_at(SIGHUP);
}

OnHangup::~OnHangup() {
  const std::lock_guard lock(guard);
  on_hangup = nullptr;
}

}  // namespace ecorche::app
