// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/net/newcomer_pace.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace ecorche::server {
namespace {

using Pace = NewcomerPace;

const Pace::Clock::time_point kStart{std::chrono::hours(100)};

TEST(NewcomerPaceTest, WhoComesNowAndThenWaitsForTheNextTick) {
  Pace pace;
  for (int i = 0; i < 5000; ++i) {
    pace.nobody();
    EXPECT_EQ(pace.after(kStart + std::chrono::milliseconds(3 * i)), Pace::between);
  }
}

// Whatever they send meanwhile: the queue's age counts, not how long the one who is let in was silent.
TEST(NewcomerPaceTest, AQueueThatIsNeverEmptyIsLetInFasterFromThenOn) {
  Pace pace;
  pace.nobody();
  EXPECT_EQ(pace.after(kStart), Pace::between);
  EXPECT_EQ(pace.after(kStart + Pace::long_wait), Pace::between);
  EXPECT_EQ(pace.after(kStart + Pace::long_wait + std::chrono::milliseconds(1)), Pace::between_many);
  EXPECT_EQ(pace.after(kStart + std::chrono::seconds(60)), Pace::between_many);
  pace.nobody();
  EXPECT_EQ(pace.after(kStart + std::chrono::seconds(61)), Pace::between) << "it was empty";
}

// A full backlog of 4096 is through within 4 s.
TEST(NewcomerPaceTest, TheLastOfAFullBacklogWaitsForSeconds) {
  Pace pace;
  auto now = kStart;
  for (int i = 0; i < 4096; ++i) now += pace.after(now);
  EXPECT_LT(now - kStart, std::chrono::seconds(4));
  EXPECT_GT(now - kStart, std::chrono::seconds(2));
}

}  // namespace
}  // namespace ecorche::server
