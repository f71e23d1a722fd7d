// SPDX-License-Identifier: Apache-2.0
// Turns, one at a time, without a session.
#include "runtime/server/schedule/turn_queue.hpp"

#include <gtest/gtest.h>

#include <string>

namespace ecorche::server {
namespace {

struct Takers {
  explicit Takers(TurnQueue::Order order, int pause = 0) : queue(io, order, pause) {}
  // `works`: there is something to do in it.
  std::shared_ptr<Turn> taker(char name, double used = 0, bool works = true) {
    const auto account = std::make_shared<Account>();
    account->use(used);
    return std::make_shared<Turn>(
        [this, name, works] {
          taken += name;
          return works;
        },
        account);
  }
  net::io_context io;
  TurnQueue queue;
  std::string taken;
};

TEST(TurnQueueTest, OneAtATimeInTheOrderOfAskingAndOnceHoweverOftenAsked) {
  Takers all(TurnQueue::Order::first_come);
  const auto a = all.taker('a', 9), b = all.taker('b', 1), idle = all.taker('i', 0, false);
  for (const auto& turn : {a, b, b, idle}) all.queue.ask(turn);
  EXPECT_EQ(all.taken, "a");
  EXPECT_FALSE(a->awaited());
  EXPECT_TRUE(b->awaited());
  all.queue.ask(a);
  all.queue.done();
  EXPECT_EQ(all.taken, "ab");
  all.queue.done();
  EXPECT_EQ(all.taken, "abia") << "who has nothing to do any more keeps nobody waiting";
}

TEST(TurnQueueTest, WhoHadLeastIsNext) {
  Takers all(TurnQueue::Order::least_used);
  const auto a = all.taker('a'), b = all.taker('b', 3), c = all.taker('c', 1);
  for (const auto& turn : {a, b, c}) all.queue.ask(turn);
  all.queue.done();
  all.queue.done();
  EXPECT_EQ(all.taken, "acb");
}

TEST(TurnQueueTest, WhoIsGoneHasNone) {
  Takers all(TurnQueue::Order::first_come);
  const auto a = all.taker('a'), c = all.taker('c');
  auto b = all.taker('b');
  for (const auto& turn : {a, b, c}) all.queue.ask(turn);
  b = nullptr;
  all.queue.done();
  EXPECT_EQ(all.taken, "ac");
}

TEST(TurnQueueTest, ATurnThatCostMuchIsFollowedByARest) {
  Takers all(TurnQueue::Order::first_come, 10);
  const auto a = all.taker('a'), b = all.taker('b');
  all.queue.ask(a);
  all.queue.ask(b);
  const auto begun = Clock::now();
  all.queue.done(std::chrono::milliseconds(2));
  EXPECT_EQ(all.taken, "a");
  all.io.run();
  EXPECT_EQ(all.taken, "ab");
  EXPECT_GE(Clock::now() - begun, std::chrono::milliseconds(20));
}

TEST(TurnQueueTest, AfterTheEndThereAreNone) {
  Takers all(TurnQueue::Order::first_come);
  const auto a = all.taker('a'), b = all.taker('b');
  all.queue.ask(a);
  all.queue.ask(b);
  all.queue.stop();
  all.queue.done();
  EXPECT_EQ(all.taken, "a");
}

}  // namespace
}  // namespace ecorche::server
