// SPDX-License-Identifier: Apache-2.0
// By when a client must have done something, without waiting for it.
#include "runtime/server/handlers/connection_deadlines.hpp"

#include <gtest/gtest.h>

namespace ecorche::server {
namespace {

using Missed = ConnectionDeadlines::Missed;

class DeadlinesTest : public testing::Test {
 protected:
  static Clock::time_point at(double when) { return Clock::time_point() + duration(1000 + when); }
  Missed missed(double when, const ConnectionDeadlines::State& state) const {
    return deadlines.check(at(when), state).missed;
  }
  double left(double when, const ConnectionDeadlines::State& state) const {
    return seconds(deadlines.check(at(when), state).left);
  }
  Limits limits;                                         // hello 5 s, stall 10 s, idle 300 s
  ConnectionDeadlines deadlines{limits, at(-1), at(0)};  // it waited a second to be let in
};

TEST_F(DeadlinesTest, AHandshakeAndAHelloAreDueFromTheClientsComing) {
  EXPECT_EQ(missed(3.9, {}), Missed::none);
  EXPECT_NEAR(left(3.9, {}), 0.1, 1e-6);
  EXPECT_EQ(missed(4, {}), Missed::handshake);
  EXPECT_EQ(missed(4, {.opened = true}), Missed::hello);
  EXPECT_EQ(missed(4, {.opened = true, .greeted = true}), Missed::none);
}

TEST_F(DeadlinesTest, SilenceHalfAMessageAndWhatIsNotRead) {
  ConnectionDeadlines::State state{.opened = true, .greeted = true};
  EXPECT_NEAR(left(100, state), 200, 1e-6);
  EXPECT_EQ(missed(300, state), Missed::idle);
  deadlines.on_read(at(290));
  EXPECT_EQ(missed(300, state), Missed::none);
  state.unfinished_since = at(290);
  EXPECT_EQ(missed(299.9, state), Missed::none);
  EXPECT_NEAR(left(299.9, state), 0.1, 1e-6);
  EXPECT_EQ(missed(300, state), Missed::half_message);
  state.stalls_at = at(300);
  EXPECT_EQ(missed(300, state), Missed::stall);
}

TEST_F(DeadlinesTest, WhoEndsHasASecondAndNothingElseIsDue) {
  const ConnectionDeadlines::State state{.ending_since = at(50), .stalls_at = at(40)};
  EXPECT_EQ(missed(50.9, state), Missed::none);
  EXPECT_NEAR(left(50.9, state), 0.1, 1e-6);
  EXPECT_EQ(missed(51, state), Missed::last_words);
}

TEST_F(DeadlinesTest, PatienceIsAQuarterWhereFramesCrowdTheMemory) {
  EXPECT_EQ(ConnectionDeadlines::patience(limits, false), std::chrono::seconds(10));
  EXPECT_EQ(ConnectionDeadlines::patience(limits, true), std::chrono::milliseconds(2500));
}

}  // namespace
}  // namespace ecorche::server
