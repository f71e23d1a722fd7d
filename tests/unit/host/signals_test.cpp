// SPDX-License-Identifier: Apache-2.0
#include "app/signals.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

namespace ecorche::app {
namespace {

using namespace std::chrono_literals;

bool stopped_within_a_second(const std::stop_token& stop) {
  for (int n = 0; n < 1000 && !stop.stop_requested(); ++n) std::this_thread::sleep_for(1ms);
  return stop.stop_requested();
}

// Each in a process of its own, for the handlers and the thread behind them stay.

[[noreturn]] void stopped_at_work() {
  const std::stop_token stop = stop_on_signals();
  if (stop.stop_requested()) std::_Exit(2);
  std::raise(SIGINT);
  std::_Exit(stopped_within_a_second(stop) ? 130 : 1);
}

TEST(Signals, StopTheWork) {
  EXPECT_EXIT(stopped_at_work(), testing::ExitedWithCode(130), "");
}

// Static objects are destroyed, in the reverse order of their making, before this is called.
void stopped_while_leaving() {
  std::raise(SIGINT);
  std::this_thread::sleep_for(200ms);  // for the thread that listens
}

[[noreturn]] void leaves_and_is_stopped() {
  std::atexit(stopped_while_leaving);
  stop_on_signals();
  std::exit(3);
}

TEST(Signals, ThatComeWhileTheProcessIsLeavingChangeNothing) {
  EXPECT_EXIT(leaves_and_is_stopped(), testing::ExitedWithCode(3), "");
}

}  // namespace
}  // namespace ecorche::app
