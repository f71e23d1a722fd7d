// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/workers.hpp"

#include <gtest/gtest.h>

#include <atomic>

namespace ecorche::server {
namespace {

TEST(Workers, FinishWhatWasSubmitted) {
  std::atomic<int> done = 0, around = 0;
  {
    Workers workers(3, [&](const Job& job) {
      ++around;
      job();
    });
    for (int i = 0; i < 100; ++i) workers.submit([&] { ++done; });
    workers.drain();
    EXPECT_EQ(done, 100);
    for (int i = 0; i < 100; ++i) workers.submit([&] { ++done; });
  }
  EXPECT_EQ(done, 200);
  EXPECT_EQ(around, 200);
}

}  // namespace
}  // namespace ecorche::server
