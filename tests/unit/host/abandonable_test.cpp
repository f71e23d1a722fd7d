// SPDX-License-Identifier: Apache-2.0
#include "app/abandonable.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <stop_token>
#include <thread>

#include <ecorche/values/context.hpp>

namespace ecorche::app {
namespace {

Context context_of(const std::stop_token& stop) {
  Context context;
  context.stop = stop;
  context.run_apart = [stop](std::function<void()> work) { run_abandonable(std::move(work), stop); };
  return context;
}

TEST(Abandonable, OnlyAProgramAsksForIt) {
  std::stop_source source;
  Context context;
  context.stop = source.get_token();
  std::thread::id ran;
  context.run_unstoppable([&] { ran = std::this_thread::get_id(); });
  EXPECT_EQ(ran, std::this_thread::get_id());
}

TEST(Abandonable, WaitsForTheWorkAndRethrows) {
  std::stop_source source;
  const Context context = context_of(source.get_token());
  auto done = std::make_shared<bool>(false);
  context.quiet().run_unstoppable([done] { *done = true; });
  EXPECT_TRUE(*done);
  EXPECT_THROW(context.run_unstoppable([] { throw std::runtime_error("no"); }), std::runtime_error);
  EXPECT_EQ(leave(3), 3);
}

[[noreturn]] void stop_in_endless_work() {
  std::atexit([] { std::_Exit(1); });  // as OpenBLAS' destructors would
  std::stop_source source;
  auto started = std::make_shared<std::atomic<bool>>(false);
  std::jthread stopper([&source, started] {
    while (!*started) std::this_thread::yield();
    source.request_stop();
  });
  try {
    context_of(source.get_token()).run_unstoppable([started] {
      *started = true;
      while (*started) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    });
  } catch (const Error& error) {
    stopper.join();
    if (error.kind() == ErrorKind::interrupted) leave(130);
  }
  std::exit(2);
}

// In a process of its own: main ends with its code, though the work goes on.
TEST(Abandonable, LeavesEndlessWorkOnAStop) {
  EXPECT_EXIT(stop_in_endless_work(), testing::ExitedWithCode(130), "");
}

TEST(Abandonable, DoesNotStartOnceStopped) {
  std::stop_source source;
  source.request_stop();
  bool ran = false;
  EXPECT_THROW(context_of(source.get_token()).run_unstoppable([&] { ran = true; }), Error);
  EXPECT_FALSE(ran);
}

}  // namespace
}  // namespace ecorche::app
