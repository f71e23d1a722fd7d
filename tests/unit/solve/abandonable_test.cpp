// SPDX-License-Identifier: Apache-2.0
#include "core/solve/abandonable.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <stop_token>
#include <thread>

namespace ecorche::solve {
namespace {

TEST(Abandonable, RunsInTheCallerWithoutAToken) {
  std::thread::id ran;
  run_abandonable([&] { ran = std::this_thread::get_id(); }, {});
  EXPECT_EQ(ran, std::this_thread::get_id());
}

TEST(Abandonable, WaitsForTheWorkAndRethrows) {
  std::stop_source source;
  Context context;
  context.stop = source.get_token();
  auto done = std::make_shared<bool>(false);
  run_abandonable([done] { *done = true; }, context);
  EXPECT_TRUE(*done);
  EXPECT_THROW(run_abandonable([] { throw std::runtime_error("no"); }, context), std::runtime_error);
}

TEST(Abandonable, LeavesEndlessWorkOnAStop) {
  std::stop_source source;
  Context context;
  context.stop = source.get_token();
  struct Shared {
    std::atomic<bool> started{false}, release{false}, ended{false};
  };
  auto shared = std::make_shared<Shared>();
  std::jthread stopper([&source, shared] {
    while (!shared->started) std::this_thread::yield();
    source.request_stop();
  });
  try {
    run_abandonable(
        [shared] {
          shared->started = true;
          while (!shared->release) std::this_thread::sleep_for(std::chrono::milliseconds(1));
          shared->ended = true;
        },
        context);
    FAIL() << "endless work came back";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::interrupted);
  }
  EXPECT_FALSE(shared->ended);
  shared->release = true;  // so that no thread outlives the test
  while (!shared->ended) std::this_thread::yield();
}

TEST(Abandonable, DoesNotStartOnceStopped) {
  std::stop_source source;
  source.request_stop();
  Context context;
  context.stop = source.get_token();
  bool ran = false;
  EXPECT_THROW(run_abandonable([&] { ran = true; }, context), Error);
  EXPECT_FALSE(ran);
}

}  // namespace
}  // namespace ecorche::solve
