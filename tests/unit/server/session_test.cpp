// SPDX-License-Identifier: Apache-2.0
// A session without a server: which poses it takes to come after a rest, when it makes keyframes, when
// judges, and what waits for memory.
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

// While the body moves, keyframes that somebody lacks keep their distance, whether a pose waits or not.
TEST(Session, AKeyframeThatIsAskedForSoonAfterTheLastKeepsItsDistance) {
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto begun = Clock::now();
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
    frames(3);
    if (stage.watcher.last() - first > milliseconds(50)) continue;  // a busy machine
    EXPECT_EQ(frames(4), (std::vector<bool>{true, false, false, true}));
    EXPECT_GE(stage.watcher.last() - begun, milliseconds(99));  // since it was made, not since it came
    return;
  }
  ADD_FAILURE() << "the machine was too busy each time";
}

TEST(Session, WhoJoinsABodyThatStandsStillGetsAKeyframeAtOnce) {
  for (int trial = 0; trial < kTrials; ++trial) {
    Stage stage(v1::ENCODING_U16_DELTA);
    stage.run_until([&] { return !stage.watcher.keyframes().empty(); });
    const auto first = stage.watcher.last();
    Watcher guest;
    stage.session->join(guest);
    stage.subscribe(guest);
    stage.run_until([&] { return !guest.keyframes().empty(); });
    stage.session->leave(guest, false);
    EXPECT_EQ(guest.keyframes(), std::vector<bool>{true});
    if (stage.watcher.last() - first < milliseconds(90)) return;
  }
  ADD_FAILURE() << "never at once";
}

// Or others would be sent every pose twice, and as keyframes.
TEST(Session, WhoComesAndGoesAllTheTimeGetsNoMoreKeyframesThanThat) {
  Stage stage(v1::ENCODING_U16_DELTA);
  stage.run_until([&] { return !stage.watcher.keyframes().empty(); });
  Watcher guest;
  stage.session->join(guest);
  std::uint64_t sequence = 0;
  const auto start = Clock::now();
  while (Clock::now() - start < milliseconds(450)) {
    const std::uint32_t number = stage.subscribe(guest);
    stage.pose(++sequence);
    stage.wait(kShort);
    stage.session->unsubscribe(guest, number);
    stage.wait(kShort);
  }
  const auto time = Clock::now() - start;
  stage.session->leave(guest, false);
  const auto& made = stage.watcher.keyframes();
  const auto keyframes = std::count(made.begin(), made.end(), true);
  EXPECT_GE(keyframes, 3) << "who joined waited for longer than it must";
  EXPECT_LE(keyframes, 2 + time / milliseconds(100));
  EXPECT_LE(made.size(), 1 + sequence + static_cast<std::size_t>(keyframes));
}

// The first frames of others are no reason to wait for longer.
TEST(Session, WhoComesAndGoesTakesNoFramesFromWhoWatchesAtTheSameRate) {
  constexpr double kRate = 4;
  Stage stage;
  Watcher rated, guest;
  stage.session->join(rated);
  stage.session->join(guest);
  stage.subscribe(rated, kRate);
  for (std::size_t turn = 1; turn <= 12; ++turn) {
    const std::uint32_t number = stage.subscribe(guest, kRate);
    stage.run_until([&] { return guest.numbers().size() >= turn; });
    stage.session->unsubscribe(guest, number);
  }
  stage.pose(1);
  const auto start = Clock::now();
  stage.run_until([&] { return rated.frame().pose_sequence() == 1; });
  EXPECT_LT(Clock::now() - start, milliseconds(1500));  // twelve times a quarter of a second
  stage.session->leave(guest, false);
  stage.session->leave(rated, false);
}

// Or a server that stops would wait, for a day at most.
TEST(Session, NothingIsDueWhenNobodyIsThere) {
  Stage stage;
  const std::uint32_t rated = stage.subscribe(stage.watcher, 1e-3);
  stage.run_until([&] { return !stage.watcher.poses(rated).empty(); });
  for (const std::uint64_t pose : {1, 2}) {
    stage.pose(pose);
    stage.run_until([&] { return stage.watcher.frame().pose_sequence() == pose; });
  }
  stage.session->leave(stage.watcher, true);
  stage.quality_turns.stop();
  stage.io.restart();
  stage.io.run_for(std::chrono::seconds(10));
  EXPECT_TRUE(stage.io.stopped());
}

// Of subscriptions that never had a frame, one job makes as many as there is room for.
TEST(Session, FirstFramesAreMadeAsFarAsTheMemoryGoes) {
  Stage stage(v1::ENCODING_F32, 1);
  stage.watcher.hold();
  for (const double rate : {1e3, 2e3, 3e3}) stage.subscribe(stage.watcher, rate);
  stage.wait(milliseconds(50));
  EXPECT_EQ(stage.watcher.numbers().size(), 1U);
  // Poses are for who had a frame, however many come.
  stage.pose(1);
  stage.run_until([&] { return stage.watcher.numbers().size() >= 2; });
  stage.wait(milliseconds(50));
  EXPECT_EQ(stage.watcher.numbers().size(), 2U);
  stage.watcher.release_frames();
  stage.session->catch_up();
  stage.run_until([&] { return stage.watcher.numbers().size() >= 3; });
  stage.wait(milliseconds(50));
  EXPECT_EQ(stage.watcher.numbers().size(), 3U);
}

// Planes may hold far more than the volume that they cut.
TEST(Session, PlanesAreCountedByTheirPixels) {
  Stage stage;
  stage.run_until([&] { return !stage.watcher.numbers().empty(); });
  stage.watcher.release_frames();
  VolumeSpec planes;
  ImageGrid plane;
  plane.size = {300, 200, 1};
  planes.slices = {plane, plane};
  stage.plane_gate.close();
  stage.session->subscribe(stage.watcher, {.id = 0, .spec = planes, .request = {}});
  stage.wait(milliseconds(50));
  EXPECT_EQ(stage.memory.bytes(), 2U * 300 * 200 * sizeof(std::int16_t));
}

// Ten times as long as a turn took, nobody has one.
TEST(Session, JudgingRestsAfterATurn) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  stage.quality_turns.done(milliseconds(60));
  stage.quality_turns.ask(stage.session->quality_turn());
  stage.wait(kShort);
  EXPECT_TRUE(stage.session->quality_turn()->awaited()) << "its turn came too soon";
  bool waits = true;
  stage.run_until([&] { return !(waits = waits && stage.session->quality_turn()->awaited()); });
  EXPECT_FALSE(waits) << "its turn never came";
}

TEST(Session, JudgingTakesOneAfterTheOther) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  const auto other = stage.open("b", true);
  stage.quality_turns.ask(stage.session->quality_turn());
  stage.quality_turns.ask(other->quality_turn());
  EXPECT_TRUE(other->quality_turn()->awaited()) << "its turn came beside another's";
}

// A long rest does not hold up the server's end.
TEST(Session, NobodyRestsWhereNothingIsJudgedAnyMore) {
  net::io_context io;
  TurnQueue turns(io, TurnQueue::Order::first_come, kQualityPause);
  turns.stop();
  turns.done(std::chrono::hours(1));
  io.run_for(milliseconds(20));
  EXPECT_TRUE(io.stopped());
}

// What was measured by thresholds that are others by now is not told with later frames.
TEST(Session, AQualityByFormerThresholdsIsNotKept) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  stage.quality_turns.done(std::chrono::seconds(3));  // nothing is judged beside the frames
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
