// SPDX-License-Identifier: Apache-2.0
#include "app/signals.hpp"

#include <mutex>
#include <thread>
#include <utility>

#include "core/platform/signals.hpp"

namespace ecorche::app {
namespace {

std::mutex guard;
std::function<void()> hangup_call;

void listen(std::stop_source& source) {
  platform::Signal which{};
  bool again = false;
  while (platform::wait_for_signal(which)) {
    if (which == platform::Signal::hangup) {
      const std::lock_guard lock(guard);
      if (hangup_call) hangup_call();
      continue;
    }
    if (std::exchange(again, true)) platform::end_process(130);
    source.request_stop();
  }
}

}  // namespace

std::stop_token stop_on_signals() {
  static std::stop_source source;
  if (!platform::catch_stops()) return source.get_token();  // signals then end the process at once
  // Lives as long as the process: nothing waits for it.
  std::thread([] { listen(source); }).detach();
  return source.get_token();
}

OnHangup::OnHangup(std::function<void()> call) {
  const std::lock_guard lock(guard);
  hangup_call = std::move(call);
  platform::catch_hangups();
}

OnHangup::~OnHangup() {
  const std::lock_guard lock(guard);
  hangup_call = nullptr;
}

}  // namespace ecorche::app
