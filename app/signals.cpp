// SPDX-License-Identifier: Apache-2.0
#include "app/signals.hpp"

#include <mutex>
#include <thread>
#include <utility>

#include "core/platform/signals.hpp"

namespace ecorche::app {
namespace {

// What the listening thread touches. It outlives main, so this is never destroyed: a signal that came while
// the process was leaving would meet it gone.
struct Listener {
  std::stop_source source;
  std::mutex guard;
  std::function<void()> hangup_call;
};

Listener& listener() {
  static Listener& only = *new Listener;
  return only;
}

void listen() {
  Listener& self = listener();
  platform::Signal which{};
  bool again = false;
  while (platform::wait_for_signal(which)) {
    if (which == platform::Signal::hangup) {
      const std::lock_guard lock(self.guard);
      if (self.hangup_call) self.hangup_call();
      continue;
    }
    if (std::exchange(again, true)) platform::end_process(130);
    self.source.request_stop();
  }
}

}  // namespace

std::stop_token stop_on_signals() {
  std::stop_token stop = listener().source.get_token();
  if (!platform::catch_stops()) return stop;  // signals then end the process at once
  std::thread(listen).detach();               // lives as long as the process: nothing waits for it
  return stop;
}

OnHangup::OnHangup(std::function<void()> call) {
  const std::lock_guard lock(listener().guard);
  listener().hangup_call = std::move(call);
  platform::catch_hangups();
}

OnHangup::~OnHangup() {
  const std::lock_guard lock(listener().guard);
  listener().hangup_call = nullptr;
}

}  // namespace ecorche::app
