// SPDX-License-Identifier: Apache-2.0
// A session without a server: which poses it takes to come after a rest, when it makes keyframes, when
// judges.
#include "tests/unit/server/session_stage.hpp"

namespace ecorche::server {
namespace {

// Poses after a rest, which takes so long on its way, and again right behind that frame: whether the second
// pose is taken to come after a rest.
std::optional<bool> right_behind(milliseconds on_its_way) {
  for (int trial = 0; trial < kTrials; ++trial) {
    Stage stage;
    EXPECT_EQ(stage.next_is_judged(), true) << "the first frame of a subscription";
    stage.wait(kLong);
    stage.gate.close();
    stage.pose(1);
    stage.wait(on_its_way);
    stage.gate.open();
    EXPECT_EQ(stage.next_is_judged(), true) << "after a rest";
    stage.wait(kShort);
    stage.pose(2);
    if (stage.in_time()) return stage.next_is_judged();
  }
  return std::nullopt;
}

TEST(Session, APoseAfterARestIsJudgedOnItsWayAndOneInAStreamIsNot) {
  EXPECT_EQ(right_behind(kShort), false);
}

TEST(Session, ARestBeginsWithTheEndOfTheLastFrameNotWithItsPose) {
  EXPECT_EQ(right_behind(kLong), false);
}

// Behind a crowd a pose waits long for its turn: no rest, however late its frame is.
TEST(Session, APoseBehindOneThatIsStillBeingMadeComesAfterNoRest) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  stage.wait(kLong);
  stage.gate.close();
  stage.pose(1);
  stage.wait(kLong);
  stage.pose(2);  // the first is on its way for longer than a rest
  stage.gate.open();
  EXPECT_EQ(stage.next_is_judged(), true);
  EXPECT_EQ(stage.next_is_judged(), false);
}

// While poses come, keyframes that somebody lacks keep their distance; once none waits, there is one at once.
TEST(Session, AKeyframeThatIsAskedForSoonAfterTheLastComesWithTheNextRest) {
  for (int trial = 0; trial < kTrials; ++trial) {
    Stage stage(v1::ENCODING_U16_DELTA);
    const auto frames = [&](std::size_t count) {
      stage.run_until([&] { return stage.watcher.keyframes().size() >= count; });
      return stage.watcher.keyframes();
    };
    ASSERT_EQ(frames(1), std::vector<bool>{true});
    const auto first = stage.watcher.last();
    stage.gate.close();
    stage.pose(1);
    stage.wait(milliseconds(20));  // until it was taken up
    stage.pose(2);                 // waits in the slot
    stage.watcher.lose_next();
    stage.gate.open();
    const std::vector<bool> made = frames(4);
    if (stage.watcher.last() - first > milliseconds(90)) continue;  // a busy machine
    EXPECT_EQ(made, (std::vector<bool>{true, false, false, true}));
    return;
  }
  ADD_FAILURE() << "the machine was too busy each time";
}

// Ten times as long as a turn took, nobody has one.
TEST(Session, JudgingRestsAfterATurn) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  stage.judging.done(milliseconds(60));
  stage.judging.ask(stage.session);
  stage.wait(kShort);
  EXPECT_TRUE(stage.session->await_judgement()) << "its turn came too soon";
  bool waits = true;
  stage.run_until([&] { return !(waits = waits && stage.session->await_judgement()); });
  EXPECT_FALSE(waits) << "its turn never came";
}

// What was measured by thresholds that are others by now is not told with later frames.
TEST(Session, AQualityByFormerThresholdsIsNotKept) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  stage.judging.done(std::chrono::seconds(3));  // nothing is judged beside the frames
  stage.wait(kLong);
  stage.gate.close();
  stage.pose(1);
  stage.wait(milliseconds(20));
  stage.session->set_thresholds({.max_volume_change = 1e-9});
  stage.gate.open();
  ASSERT_EQ(stage.next_is_judged(), true);
  stage.pose(2);
  EXPECT_EQ(stage.next_is_judged(), true);
}

TEST(Session, AnUnnamedOneWaitsOnlyForWhoMayComeBack) {
  Stage stage;
  const auto own = stage.open("-1");
  Watcher guest;
  own->join(guest);
  EXPECT_FALSE(own->over(Clock::now()));
  own->leave(guest, true);
  EXPECT_FALSE(own->over(Clock::now()));
  EXPECT_TRUE(own->over(Clock::now() + duration(stage.limits.linger_seconds)));
  own->join(guest);
  own->leave(guest, false);
  EXPECT_TRUE(own->over(Clock::now()));
}

}  // namespace
}  // namespace ecorche::server
