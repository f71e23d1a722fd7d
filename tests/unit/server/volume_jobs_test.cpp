// SPDX-License-Identifier: Apache-2.0
// Volumes beside the meshes of newer poses.
#include "runtime/server/recording.hpp"
#include "tests/unit/server/session_stage.hpp"

namespace ecorche::server {
namespace {

using Poses = std::vector<std::uint64_t>;

struct VolumeStage : Stage {
  VolumeStage() {
    run_until([this] { return watcher.judged().size() == 1; });
  }
  // Waits until the last frame of the subscription shows the pose.
  bool shows(std::uint32_t subscription, std::uint64_t pose) {
    run_until([&] {
      const Poses poses = watcher.poses(subscription);
      return !poses.empty() && poses.back() == pose;
    });
    const Poses poses = watcher.poses(subscription);
    return !poses.empty() && poses.back() == pose;
  }
  static constexpr std::uint32_t mesh = 1;  // the watcher's
};

// While one is made, meshes show every pose; then it shows the newest, and none between.
TEST(VolumeJobs, MeshesDoNotWaitAndTheNewestPoseFollows) {
  VolumeStage stage;
  const std::uint32_t volume = stage.subscribe_volume(stage.watcher);
  ASSERT_TRUE(stage.shows(volume, 0));
  stage.volume_gate.close();
  for (std::uint64_t pose = 1; pose <= 5; ++pose) {
    stage.pose(pose);
    ASSERT_TRUE(stage.shows(stage.mesh, pose)) << pose;
  }
  EXPECT_EQ(stage.watcher.poses(volume), Poses({0}));
  stage.volume_gate.open();
  ASSERT_TRUE(stage.shows(volume, 5));
  stage.wait(milliseconds(50));
  EXPECT_EQ(stage.watcher.poses(volume), Poses({0, 1, 5}));
  EXPECT_EQ(stage.watcher.poses(stage.mesh), Poses({0, 1, 2, 3, 4, 5})) << "each once";
}

// Nor do planes of a volume, which take a hundredth of the time.
TEST(VolumeJobs, PlanesDoNotWaitForWholeOnes) {
  VolumeStage stage;
  const std::uint32_t volume = stage.subscribe_volume(stage.watcher);
  ASSERT_TRUE(stage.shows(volume, 0));
  stage.volume_gate.close();
  stage.pose(1);
  ASSERT_TRUE(stage.shows(stage.mesh, 1));
  const std::uint32_t plane = stage.subscribe_volume(stage.watcher, true);
  ASSERT_TRUE(stage.shows(plane, 1));
  stage.pose(2);
  ASSERT_TRUE(stage.shows(plane, 2));
  EXPECT_EQ(stage.watcher.poses(volume), Poses({0}));
  stage.volume_gate.open();
  ASSERT_TRUE(stage.shows(volume, 2));
}

// With nothing else to see, poses are made and told all the same.
TEST(VolumeJobs, AloneShowTheNewestPoseToo) {
  VolumeStage stage;
  stage.session->unsubscribe(stage.watcher, stage.mesh);
  const std::uint32_t volume = stage.subscribe_volume(stage.watcher);
  ASSERT_TRUE(stage.shows(volume, 0));
  for (std::uint64_t pose = 1; pose <= 3; ++pose) stage.pose(pose);
  ASSERT_TRUE(stage.shows(volume, 3));
  EXPECT_EQ(stage.session->present().sequence, 3U);
}

TEST(VolumeJobs, KeepTheirRate) {
  VolumeStage stage;
  const std::uint32_t volume = stage.subscribe_volume(stage.watcher, false, 4);
  ASSERT_TRUE(stage.shows(volume, 0));
  const auto begun = Clock::now();
  for (std::uint64_t pose = 1; pose <= 5; ++pose) {
    stage.pose(pose);
    ASSERT_TRUE(stage.shows(stage.mesh, pose));
  }
  ASSERT_TRUE(stage.shows(volume, 5)) << "the last pose is never held back";
  const double quarters = 4 * seconds(Clock::now() - begun);
  EXPECT_LE(static_cast<double>(stage.watcher.poses(volume).size()), 3 + quarters);
}

// Who goes while a volume is made is sent nothing any more, and who comes gets one of its own.
TEST(VolumeJobs, AreForWhoIsThere) {
  VolumeStage stage;
  stage.volume_gate.close();
  const std::uint32_t first = stage.subscribe_volume(stage.watcher);
  stage.wait(milliseconds(20));
  stage.session->unsubscribe(stage.watcher, first);
  const std::uint32_t second = stage.subscribe_volume(stage.watcher);
  stage.wait(milliseconds(20));
  EXPECT_NE(first, second);
  EXPECT_TRUE(stage.watcher.poses(second).empty()) << "one job at a time";
  stage.volume_gate.open();
  ASSERT_TRUE(stage.shows(second, 0));
  EXPECT_TRUE(stage.watcher.poses(first).empty());
}

// A session whose volume is being made is not over, though nobody is there any more.
TEST(VolumeJobs, KeepTheirSession) {
  VolumeStage stage;
  stage.volume_gate.close();
  {
    Guest guest(stage);
    VolumeWant want;
    guest.session->subscribe(guest.watcher, {.id = 0, .want = want, .request = {}});
    ASSERT_TRUE(guest.sees(1, std::chrono::seconds(20)));
    guest.session->leave(guest.watcher, false);
    EXPECT_FALSE(guest.session->over(Clock::now()));
    EXPECT_FALSE(guest.session->waiting().has_value());
    stage.volume_gate.open();
    stage.run_until([&] { return guest.session->over(Clock::now()); });
    EXPECT_TRUE(guest.session->over(Clock::now()));
    EXPECT_EQ(guest.frames(), 1U);
  }
}

// Without room for frames whoever has had some gets more, and whoever has not waits.
TEST(VolumeJobs, FirstOnesWaitForMemory) {
  VolumeStage stage;
  const std::uint32_t volume = stage.subscribe_volume(stage.watcher);
  ASSERT_TRUE(stage.shows(volume, 0));
  auto all = std::make_unique<FrameMemory::Room>(stage.memory, std::uint64_t{2} << 30);
  const std::uint32_t plane = stage.subscribe_volume(stage.watcher, true);
  stage.pose(1);
  ASSERT_TRUE(stage.shows(volume, 1));
  stage.wait(milliseconds(30));
  EXPECT_TRUE(stage.watcher.poses(plane).empty());
  all.reset();
  stage.session->catch_up();
  EXPECT_TRUE(stage.shows(plane, 1));
}

// What is recorded is whole: every pose with its volume, and no two jobs of one volume at a time.
TEST(VolumeJobs, RecordedPosesKeepTheirVolumes) {
  VolumeStage stage;
  const std::uint32_t volume = stage.subscribe_volume(stage.watcher);
  ASSERT_TRUE(stage.shows(volume, 0));
  stage.volume_gate.close();
  stage.pose(1);
  ASSERT_TRUE(stage.shows(stage.mesh, 1));
  stage.session->record(std::make_shared<Recording>("bow", *stage.model, "test", std::size_t{1} << 20));
  stage.pose(2);
  stage.wait(milliseconds(50));
  EXPECT_EQ(stage.watcher.poses(stage.mesh).back(), 1U) << "it waits for the volume that is being made";
  stage.volume_gate.open();
  ASSERT_TRUE(stage.shows(volume, 2));
  for (std::uint64_t pose = 3; pose <= 5; ++pose) {
    stage.pose(pose);
    ASSERT_TRUE(stage.shows(stage.mesh, pose));
  }
  ASSERT_TRUE(stage.shows(volume, 5));
  EXPECT_EQ(stage.watcher.poses(volume), Poses({0, 1, 2, 3, 4, 5}));
  stage.session->record(nullptr);
  stage.pose(6);
  EXPECT_TRUE(stage.shows(volume, 6));
}

}  // namespace
}  // namespace ecorche::server
