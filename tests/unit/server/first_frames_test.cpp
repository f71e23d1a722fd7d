// SPDX-License-Identifier: Apache-2.0
// What newcomers are shown first: beside streams, with the next pose, or as others were.
#include "tests/unit/server/session_stage.hpp"

namespace ecorche::server {
namespace {

// Who opens a body beside a stream takes no worker from it; where nothing is streamed, a worker is quicker.
TEST(FirstFrames, GoBesideStreamsWithoutWorkers) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  stage.gate.close();
  Guest first(stage);
  EXPECT_FALSE(first.sees(1, kLong)) << "a worker's job, which is kept";
  stage.activity.streamed(Clock::now() + std::chrono::hours(1));
  std::vector<std::unique_ptr<Guest>> guests;
  guests.reserve(4);
  for (int i = 0; i < 3; ++i) guests.push_back(std::make_unique<Guest>(stage));
  guests.push_back(nullptr);
  {
    Guest gone(stage);  // before its turn
    stage.wait(kShort);
  }
  guests.back() = std::make_unique<Guest>(stage);
  for (const auto& guest : guests) EXPECT_TRUE(guest->sees(1, std::chrono::seconds(20)));
  EXPECT_EQ(first.frames(), 0U);
  stage.gate.open();
  EXPECT_TRUE(first.sees(1, std::chrono::seconds(20)));
}

// Turns are taken one by one, in the order of asking, and none after the end.
TEST(FirstFrames, TakeTurns) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  stage.activity.streamed(Clock::now() + std::chrono::hours(1));
  Gate gate;
  gate.close();
  stage.executor.submit(Service::first_frames, [&] { gate.pass(); });  // the thread is busy for as long
  Guest first(stage), second(stage);
  stage.wait(kShort);
  EXPECT_TRUE(second.session->first_frame_turn()->awaited()) << "it waits for its turn";
  EXPECT_FALSE(first.session->first_frame_turn()->awaited()) << "its turn has come";
  stage.first_frames.stop();
  gate.open();
  EXPECT_TRUE(first.sees(1, std::chrono::seconds(20)));
  EXPECT_FALSE(second.sees(1, kLong));
}

// Within its own stream a newcomer is shown the next pose, which has the newcomer's stream wait for nothing;
// where none comes, the present one.
TEST(FirstFrames, ANewcomerComesInWithTheNextPose) {
  for (int trial = 0; trial < kTrials; ++trial) {
    Stage stage;
    ASSERT_EQ(stage.next_is_judged(), true);
    Watcher newcomer;
    stage.session->join(newcomer);
    MeshSpec spec;
    spec.tissues = {0};
    spec.normals = true;
    const auto comes = [&](std::size_t count) {
      stage.run_until([&] { return newcomer.judged().size() >= count; });
      return newcomer.judged().size() >= count;
    };
    const auto begun = Clock::now();
    stage.pose(1);
    ASSERT_TRUE(stage.next_is_judged().has_value());
    const std::uint32_t id = stage.session->subscribe(newcomer, {.id = 0, .spec = spec, .request = {}})->id;
    stage.wait(milliseconds(10));
    const bool early = !newcomer.judged().empty();
    stage.pose(2);
    const bool in_time = Clock::now() - begun < milliseconds(40);
    ASSERT_TRUE(comes(1));
    stage.session->unsubscribe(newcomer, id);
    if (!in_time) {  // a busy machine
      stage.session->leave(newcomer, false);
      continue;
    }
    EXPECT_FALSE(early);
    EXPECT_EQ(newcomer.frame().pose_sequence(), 2U);
    EXPECT_EQ(newcomer.frame().quality().pose_sequence(), 0U) << "known of these tissues, told with its pose";
    EXPECT_FALSE(newcomer.judged().front());
    stage.wait(milliseconds(20));
    stage.session->subscribe(newcomer, {.id = 0, .spec = spec, .request = {}});
    EXPECT_TRUE(comes(2)) << "no pose came";
    EXPECT_EQ(newcomer.frame().pose_sequence(), 2U);
    EXPECT_EQ(newcomer.frame().quality().pose_sequence(), 2U) << "no older one, where there is time";
    stage.session->leave(newcomer, false);
    return;
  }
  ADD_FAILURE() << "the machine was too busy each time";
}

// However many sessions begin, the rest pose is measured once, and its positions lie in memory once.
TEST(FirstFrames, TheRestPoseIsMadeOnce) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  EXPECT_EQ(stage.watcher.frame().quality().pose_sequence(), 0U);
  const auto shown = stage.watcher.bytes();  // stays in memory
  Guest guest(stage);
  ASSERT_TRUE(guest.sees(1, std::chrono::seconds(20)));
  EXPECT_FALSE(guest.watcher.judged().back());
  EXPECT_EQ(guest.watcher.frame().quality().SerializeAsString(),
            stage.watcher.frame().quality().SerializeAsString());
  ASSERT_NE(guest.watcher.positions(), nullptr);
  EXPECT_EQ(guest.watcher.positions(), stage.watcher.positions());
  guest.ask(v1::ENCODING_U16, true);  // of which nothing lies there
  ASSERT_TRUE(guest.sees(2, std::chrono::seconds(20)));
  EXPECT_FALSE(guest.watcher.judged().back());
  EXPECT_EQ(guest.watcher.positions(), nullptr);
  // By other thresholds it is judged anew, where its positions are known.
  Guest strict(stage, {.max_volume_change = 1e-9});
  ASSERT_TRUE(strict.sees(1, std::chrono::seconds(20)));
  EXPECT_EQ(strict.watcher.positions(), stage.watcher.positions());
  EXPECT_TRUE(strict.watcher.judged().back());
  const v1::PoseQuality anew = strict.watcher.frame().quality(), known = stage.watcher.frame().quality();
  EXPECT_EQ(anew.max_volume_change(), 1e-9);
  EXPECT_EQ(anew.volume_change(), known.volume_change());
  EXPECT_EQ(anew.tissues(0).share(), known.tissues(0).share());
  // Any other pose is its session's own.
  stage.pose(1);
  ASSERT_TRUE(stage.next_is_judged().has_value());
  EXPECT_NE(stage.watcher.positions(), shown->pieces.parts.front().data());
}

}  // namespace
}  // namespace ecorche::server
