// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/net/flow.hpp"

#include <gtest/gtest.h>

namespace ecorche::server {
namespace {

using std::chrono::milliseconds;

// A way that takes `way` and, of level l, `bytes` / 4^l over `rate` bytes a millisecond; one frame after
// another.
struct Way {
  milliseconds way;
  double bytes, rate;
  Clock::time_point now = Clock::now();
  std::uint64_t number = 0;

  std::uint32_t send(Flow& flow, std::uint32_t coarsest = 3) {
    const std::uint32_t level = flow.level(0, coarsest, now);
    flow.left(++number, now);
    double size = bytes;
    for (std::uint32_t l = 0; l < level; ++l) size /= 4;
    now += way + milliseconds(static_cast<int>(size / rate));
    flow.arrived(number, now);
    return level;
  }
};

TEST(Flow, AFastWayKeepsAllDetail) {
  Flow flow(2);
  Way way{.way = milliseconds(1), .bytes = 15e6, .rate = 1e6};
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(way.send(flow), 0U);
}

TEST(Flow, ASlowWayLosesDetailAtOnceAndKeepsWhatItCarries) {
  Flow flow(2);
  Way way{.way = milliseconds(100), .bytes = 5e6, .rate = 12.5e3};  // 400 ms for all of it
  std::uint32_t level = 0;
  for (int i = 0; i < 4; ++i) level = way.send(flow);
  EXPECT_GE(level, 1U);
  for (int i = 0; i < 200; ++i) level = way.send(flow);
  EXPECT_GE(level, 1U);
  // It becomes fast: detail comes back.
  way.rate = 1e6;
  for (int i = 0; i < 600; ++i) level = way.send(flow);
  EXPECT_EQ(level, 0U);
}

TEST(Flow, TriesThatFailBecomeRare) {
  Flow flow(2);
  Way way{.way = milliseconds(100), .bytes = 8e6, .rate = 12.5e3};  // level 1: 160 ms, too much; level 2: 40
  const auto start = way.now;
  int tries = 0;
  std::uint32_t before = 3;
  while (way.now - start < std::chrono::seconds(120)) {
    const std::uint32_t level = way.send(flow);
    if (level < before) ++tries;
    before = level;
  }
  EXPECT_LT(tries, 20);
}

TEST(Flow, MoreThanAFewAreOnTheirWayOnlyWhileNoneIsOverdue) {
  Flow flow(2);
  auto now = Clock::now();
  for (std::uint64_t n = 1; n <= 2; ++n) {
    EXPECT_TRUE(flow.may_leave(now));
    flow.left(n, now);
  }
  EXPECT_FALSE(flow.may_leave(now));  // nothing is known of the way
  now += milliseconds(100);
  flow.arrived(2, now);
  for (std::uint64_t n = 3; n <= 40 && flow.may_leave(now); ++n, now += milliseconds(10)) flow.left(n, now);
  EXPECT_EQ(now - *flow.oldest(), milliseconds(160));
  EXPECT_FALSE(flow.may_leave(now));
  now += std::chrono::seconds(5);
  EXPECT_FALSE(flow.may_leave(now));
}

// However long the way: what is on it is a backlog, should it become slow.
TEST(Flow, NeverMoreThanSixteenAreOnTheirWay) {
  Flow flow(2);
  auto now = Clock::now();
  flow.left(1, now);
  now += std::chrono::seconds(1);
  flow.arrived(1, now);
  std::uint64_t n = 2;
  for (; n <= 100 && flow.may_leave(now); ++n) flow.left(n, now);
  EXPECT_EQ(n, 18U);
}

// Of frames that left before detail was lowered, lateness says nothing about the lower one.
TEST(Flow, WhatLeftBeforeAChangeDoesNotCount) {
  Flow flow(8);
  auto now = Clock::now();
  flow.level(0, 3, now);
  flow.left(1, now);
  flow.arrived(1, now + milliseconds(20));
  now += milliseconds(50);
  for (std::uint64_t n = 2; n <= 8; ++n) flow.left(n, now);
  now += milliseconds(130);  // each late, by what one level mends
  for (std::uint64_t n = 2; n <= 8; ++n) flow.arrived(n, now);
  EXPECT_EQ(flow.level(0, 3, now), 1U);
}

// Late is by the delays of the last seconds: a way that has become longer is not a slow one for ever.
TEST(Flow, AWayThatBecomesLongerIsGotUsedTo) {
  Flow flow(2);
  Way way{.way = milliseconds(10), .bytes = 1e6, .rate = 1e6};
  for (int i = 0; i < 100; ++i) EXPECT_EQ(way.send(flow), 0U);
  way.way = milliseconds(150);
  std::uint32_t level = 0;
  for (int i = 0; i < 10; ++i) level = way.send(flow);
  EXPECT_GE(level, 1U);
  for (int i = 0; i < 400; ++i) level = way.send(flow);
  EXPECT_EQ(level, 0U);
}

TEST(Flow, ALostPacketKeepsOthersForTwoShortDelaysAndHalfASecondAtMost) {
  Flow flow(2);
  EXPECT_EQ(flow.longest_gap(), Clock::duration());
  Way slow{.way = milliseconds(1600), .bytes = 0, .rate = 1};
  slow.send(flow);
  EXPECT_EQ(flow.longest_gap(), milliseconds(500));
  Way quick{.way = milliseconds(100), .bytes = 0, .rate = 1, .now = slow.now, .number = slow.number};
  quick.send(flow);
  EXPECT_EQ(flow.longest_gap(), milliseconds(200));
}

TEST(Flow, NoCoarserLevelThanThereIs) {
  Flow flow(2);
  Way way{.way = milliseconds(100), .bytes = 1e9, .rate = 1};
  for (int i = 0; i < 5; ++i) EXPECT_LE(way.send(flow, 1), 1U);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(way.send(flow, 0), 0U);
}

}  // namespace
}  // namespace ecorche::server
