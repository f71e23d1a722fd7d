// SPDX-License-Identifier: Apache-2.0
// What leaves for one client, and in how many writes, without a socket.
#include "runtime/server/handlers/client_output.hpp"

#include "tests/unit/server/client_stage.hpp"

namespace ecorche::server {
namespace {

struct OutputTest : testing::Test {
  static v1::Envelope pong(const std::string& data) {
    v1::Envelope envelope;
    envelope.mutable_pong()->set_data(data);
    return envelope;
  }
  static PosedFrame posed(std::uint64_t number, std::size_t payload_bytes = 16) {
    PosedFrame frame;
    frame.subscription = 1;
    frame.number = number;
    frame.bytes = std::make_shared<const wire::EncodedFrame>(
        wire::encode(pong("frame"), std::make_shared<const wire::Payload>(payload_bytes)));
    return frame;
  }
  // What the next write holds; it is over then.
  std::vector<std::string> write(bool join = true) {
    std::vector<std::string> said;
    const ClientOutput::Write* const write = output.next(Clock::now(), join);
    if (!write) return said;
    EXPECT_TRUE(output.writing());
    for (const SharedFrame& frame : write->frames) said.push_back(envelope_of(*frame).pong().data());
    output.written(Clock::now());
    EXPECT_FALSE(output.writing());
    return said;
  }

  net::io_context io;
  Limits limits;
  MemoryBudget memory{std::uint64_t{1} << 20, std::uint64_t{1} << 20};
  Metrics metrics;
  ClientOutput output{io.get_executor(), limits, memory, metrics};
};

using Said = std::vector<std::string>;

TEST_F(OutputTest, AWriteJoinsAnswersAndOneFrame) {
  EXPECT_FALSE(output.next(Clock::now(), true));
  output.deliver(posed(1));
  output.deliver(posed(2));
  output.answer(pong("a"), nullptr);
  output.answer(pong("b"), nullptr);
  EXPECT_EQ(write(), (Said{"a", "b", "frame"}));
  for (int i = 0; i < 40; ++i) output.answer(pong(std::to_string(i)), nullptr);
  EXPECT_EQ(write().size(), 16U);
  EXPECT_EQ(write(false), Said{"16"});  // where a message of the carrier is one frame
}

TEST_F(OutputTest, NothingLeavesAfterTheLastAnswer) {
  output.deliver(posed(1));
  output.answer(pong("last"), nullptr);
  output.finish(CloseReason::going_away);
  EXPECT_EQ(write(), Said{"last"});
  EXPECT_EQ(write(), Said{});
  EXPECT_EQ(output.finished_by(), CloseReason::going_away);
}

TEST_F(OutputTest, AWriteThatFailedIsItsCallersToDestroy) {
  const PosedFrame frame = posed(1);
  output.deliver(frame);
  ASSERT_TRUE(output.next(Clock::now(), true));
  EXPECT_EQ(output.bytes(), frame.bytes->bytes());
  const long held = frame.bytes.use_count();
  auto rest = output.failed();
  EXPECT_EQ(output.bytes(), 0U);
  EXPECT_EQ(frame.bytes.use_count(), held);
  rest.reset();
  EXPECT_EQ(frame.bytes.use_count(), held - 1);
}

TEST_F(OutputTest, SomeAnswersMayWaitAndThenNoMoreIsAsked) {
  for (int i = 0; i < 64; ++i) output.answer(pong("x"), nullptr);
  EXPECT_TRUE(output.takes_answers());
  output.answer(pong("x"), nullptr);
  EXPECT_FALSE(output.takes_answers());
}

TEST_F(OutputTest, IsUnreadWhileNothingMovesAndStalledInTheEnd) {
  const auto start = Clock::now();
  const auto later = [&](double time) { return start + duration(time); };
  EXPECT_EQ(output.unread(later(100), std::nullopt, duration(0.1)), 0U);
  output.answer(pong("a"), nullptr);
  ASSERT_TRUE(output.next(start, true));
  EXPECT_EQ(output.unread(later(0.05), std::nullopt, duration(0.1)), 0U);
  EXPECT_EQ(output.unread(later(0.2), std::nullopt, duration(0.1)), output.bytes());
  EXPECT_EQ(output.unread(later(0.2), later(0.15), duration(0.1)), 0U);
  EXPECT_EQ(output.stalls_at(std::nullopt, duration(10), false), later(10));
  output.written(later(0.3));
  EXPECT_FALSE(output.stalls_at(std::nullopt, duration(10), false));

  output.deliver(posed(1));
  ASSERT_TRUE(output.next(later(1), true));
  output.written(later(2));
  EXPECT_EQ(output.stalls_at(std::nullopt, duration(10), false), later(12));  // until it is acknowledged
  EXPECT_EQ(output.stalls_at(std::nullopt, duration(2.5), true), later(3.5));
  output.acknowledge(1, 1);
  EXPECT_FALSE(output.stalls_at(std::nullopt, duration(10), false));
}

// A quarter of a MiB is its share.
TEST_F(OutputTest, BeyondItsShareItTakesFramesOnlyOfWhatItReads) {
  const std::size_t large = 200 << 10;
  EXPECT_TRUE(output.may_take(1, large));
  output.deliver(posed(1, large));
  EXPECT_TRUE(output.may_take(1, 1 << 10));
  EXPECT_FALSE(output.may_take(1, large));
  ASSERT_EQ(write(), Said{"frame"});
  output.acknowledge(1, 1);
  output.deliver(posed(2, large));
  EXPECT_TRUE(output.may_take(1, large + 64));
  EXPECT_FALSE(output.may_take(2, large + 64));
}

}  // namespace
}  // namespace ecorche::server
