// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/net/outbox.hpp"

#include <gtest/gtest.h>

namespace ecorche::server {
namespace {

SharedFrame frame(const std::string& text) {
  return std::make_shared<const wire::EncodedFrame>(wire::EncodedFrame{.head = text, .payload = nullptr});
}

std::string next(Outbox& outbox) {
  const SharedFrame next = outbox.next(Clock::now());
  return next ? next->head : "";
}

TEST(Outbox, AnswersComeFirstAndInOrder) {
  Outbox outbox(2);
  outbox.enqueue(1, 0, 1, 0, frame("mesh"));
  outbox.answer(frame("a"));
  outbox.answer(frame("b"));
  EXPECT_EQ(outbox.answer_bytes(), frame("a")->bytes() + frame("b")->bytes());
  EXPECT_EQ(next(outbox), "a");
  EXPECT_EQ(outbox.answer_bytes(), frame("b")->bytes());
  EXPECT_EQ(next(outbox), "b");
  EXPECT_EQ(next(outbox), "mesh");
  EXPECT_EQ(next(outbox), "");
}

TEST(Outbox, TheNewestReplacesTheOneThatWaits) {
  Outbox outbox(2);
  for (std::uint64_t n = 1; n <= 2; ++n) {
    outbox.enqueue(1, 0, n, 0, frame(std::to_string(n)));
    EXPECT_EQ(next(outbox), std::to_string(n));
  }
  for (std::uint64_t n = 3; n <= 9; ++n) outbox.enqueue(1, 0, n, 0, frame(std::to_string(n)));
  EXPECT_EQ(next(outbox), "");  // two are on their way
  EXPECT_EQ(outbox.replaced(), 6U);
  outbox.acknowledge(1, 1, Clock::now());
  EXPECT_EQ(next(outbox), "9");
  EXPECT_EQ(next(outbox), "");
}

TEST(Outbox, AnAcknowledgementCountsForAllBefore) {
  Outbox outbox(2);
  for (std::uint64_t n = 1; n <= 2; ++n) {
    outbox.enqueue(1, 0, n, 0, frame("x"));
    next(outbox);
  }
  EXPECT_TRUE(outbox.oldest_in_flight());
  outbox.acknowledge(1, 2, Clock::now());
  EXPECT_FALSE(outbox.oldest_in_flight());
  outbox.acknowledge(7, 1, Clock::now());  // of no subscription
}

TEST(Outbox, SubscriptionsTakeTurns) {
  Outbox outbox(100);
  std::string order;
  for (std::uint64_t n = 1; n <= 3; ++n) {
    outbox.enqueue(1, 0, n, 0, frame("a"));
    outbox.enqueue(2, 0, n, 0, frame("b"));
    outbox.enqueue(5, 0, n, 0, frame("c"));
    for (int i = 0; i < 3; ++i) order += next(outbox);
  }
  EXPECT_EQ(order, "abcabcabc");
  outbox.enqueue(1, 0, 4, 0, frame("a"));
  outbox.enqueue(2, 0, 4, 0, frame("b"));
  EXPECT_EQ(next(outbox), "a");
  outbox.enqueue(1, 0, 5, 0, frame("a"));
  EXPECT_EQ(next(outbox), "b");  // not a again
}

TEST(Outbox, TheOldestOnItsWayIsKnown) {
  Outbox outbox(2);
  const auto start = Clock::now();
  outbox.enqueue(2, 0, 1, 0, frame("x"));
  outbox.next(start);
  outbox.enqueue(1, 0, 1, 0, frame("y"));
  outbox.next(start + std::chrono::seconds(5));
  EXPECT_EQ(outbox.oldest_in_flight(), start);
  outbox.forget(2);
  EXPECT_EQ(outbox.oldest_in_flight(), start + std::chrono::seconds(5));
}

TEST(Outbox, AKeyframeLeavesBeforeTheDeltasAgainstIt) {
  Outbox outbox(4);
  EXPECT_FALSE(outbox.enqueue(1, 0, 2, 1, frame("2")));  // keyframe 1 never came by
  EXPECT_EQ(next(outbox), "");
  EXPECT_TRUE(outbox.enqueue(1, 0, 3, 3, frame("key 3")));
  EXPECT_TRUE(outbox.enqueue(1, 0, 4, 3, frame("4")));
  EXPECT_TRUE(outbox.enqueue(1, 0, 5, 3, frame("5")));
  EXPECT_EQ(next(outbox), "key 3");
  EXPECT_EQ(next(outbox), "5");
  // A newer keyframe makes all that waits worthless.
  EXPECT_TRUE(outbox.enqueue(1, 0, 6, 6, frame("key 6")));
  EXPECT_TRUE(outbox.enqueue(1, 0, 7, 6, frame("7")));
  EXPECT_TRUE(outbox.enqueue(1, 0, 8, 8, frame("key 8")));
  EXPECT_FALSE(outbox.enqueue(1, 0, 9, 6, frame("9")));
  EXPECT_EQ(next(outbox), "key 8");
  EXPECT_EQ(next(outbox), "");
  EXPECT_EQ(outbox.replaced(), 3U);
}

TEST(Outbox, FramesOfAnotherLevelAreForOthers) {
  Outbox outbox(4);
  EXPECT_EQ(outbox.ask_level(1, 2, 2, false, Clock::now()), 2U);
  EXPECT_TRUE(outbox.enqueue(1, 0, 1, 0, frame("whole")));
  EXPECT_TRUE(outbox.enqueue(1, 2, 1, 0, frame("coarse")));
  EXPECT_EQ(next(outbox), "coarse");
  EXPECT_EQ(next(outbox), "");
  // A keyframe of level 2 that waits, and is replaced by one of level 3, never came.
  EXPECT_TRUE(outbox.enqueue(1, 2, 5, 5, frame("key 5")));
  EXPECT_EQ(outbox.ask_level(1, 3, 3, false, Clock::now()), 3U);
  EXPECT_TRUE(outbox.enqueue(1, 3, 6, 6, frame("key 6")));
  EXPECT_EQ(outbox.ask_level(1, 2, 2, false, Clock::now()), 2U);
  EXPECT_FALSE(outbox.enqueue(1, 2, 7, 5, frame("7")));
  EXPECT_EQ(next(outbox), "key 6");
}

// What a client that is gone was to be sent goes with who holds it, wherever that is.
TEST(Outbox, LetsGoOfEverything) {
  Outbox outbox(2);
  const SharedFrame shown = frame("mesh");
  outbox.answer(frame("answer"));
  EXPECT_TRUE(outbox.enqueue(7, 0, 1, 0, shown));
  EXPECT_EQ(shown.use_count(), 2);
  std::shared_ptr<const void> all = outbox.clear();
  EXPECT_EQ(shown.use_count(), 2);
  EXPECT_EQ(outbox.next(Clock::now()), nullptr);
  EXPECT_EQ(outbox.answers(), 0U);
  all = nullptr;
  EXPECT_EQ(shown.use_count(), 1);
}

}  // namespace
}  // namespace ecorche::server
