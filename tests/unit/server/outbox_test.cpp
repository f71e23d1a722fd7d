// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/outbox.hpp"

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
  outbox.offer(1, 1, frame("mesh"));
  outbox.answer({.head = "a", .payload = nullptr});
  outbox.answer({.head = "b", .payload = nullptr});
  EXPECT_EQ(next(outbox), "a");
  EXPECT_EQ(next(outbox), "b");
  EXPECT_EQ(next(outbox), "mesh");
  EXPECT_EQ(next(outbox), "");
}

TEST(Outbox, TheNewestReplacesTheOneThatWaits) {
  Outbox outbox(2);
  for (std::uint64_t n = 1; n <= 2; ++n) {
    outbox.offer(1, n, frame(std::to_string(n)));
    EXPECT_EQ(next(outbox), std::to_string(n));
  }
  for (std::uint64_t n = 3; n <= 9; ++n) outbox.offer(1, n, frame(std::to_string(n)));
  EXPECT_EQ(next(outbox), "");  // two are on their way
  EXPECT_EQ(outbox.replaced(), 6U);
  outbox.acknowledge(1, 1);
  EXPECT_EQ(next(outbox), "9");
  EXPECT_EQ(next(outbox), "");
}

TEST(Outbox, AnAcknowledgementCountsForAllBefore) {
  Outbox outbox(2);
  for (std::uint64_t n = 1; n <= 2; ++n) {
    outbox.offer(1, n, frame("x"));
    next(outbox);
  }
  EXPECT_TRUE(outbox.oldest_in_flight());
  outbox.acknowledge(1, 2);
  EXPECT_FALSE(outbox.oldest_in_flight());
  outbox.acknowledge(7, 1);  // of no subscription
}

TEST(Outbox, SubscriptionsTakeTurns) {
  Outbox outbox(100);
  std::string order;
  for (std::uint64_t n = 1; n <= 3; ++n) {
    outbox.offer(1, n, frame("a"));
    outbox.offer(2, n, frame("b"));
    outbox.offer(5, n, frame("c"));
    for (int i = 0; i < 3; ++i) order += next(outbox);
  }
  EXPECT_EQ(order, "abcabcabc");
  outbox.offer(1, 4, frame("a"));
  outbox.offer(2, 4, frame("b"));
  EXPECT_EQ(next(outbox), "a");
  outbox.offer(1, 5, frame("a"));
  EXPECT_EQ(next(outbox), "b");  // not a again
}

TEST(Outbox, TheOldestOnItsWayIsKnown) {
  Outbox outbox(2);
  const auto start = Clock::now();
  outbox.offer(2, 1, frame("x"));
  outbox.next(start);
  outbox.offer(1, 1, frame("y"));
  outbox.next(start + std::chrono::seconds(5));
  EXPECT_EQ(outbox.oldest_in_flight(), start);
  outbox.forget(2);
  EXPECT_EQ(outbox.oldest_in_flight(), start + std::chrono::seconds(5));
}

}  // namespace
}  // namespace ecorche::server
