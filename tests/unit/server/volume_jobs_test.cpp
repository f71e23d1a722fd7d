// SPDX-License-Identifier: Apache-2.0
// Volumes beside the meshes of newer poses.
#include "runtime/server/session/pose_job.hpp"
#include "runtime/server/session/recording.hpp"
#include "runtime/server/session/retained_bytes.hpp"
#include "runtime/server/session/volume_stream.hpp"
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
  EXPECT_EQ(stage.session->poses().present().sequence, 3U);
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
    VolumeSpec spec;
    guest.session->subscribe(guest.watcher, {.id = 0, .spec = spec, .request = {}});
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

// A server that stops makes none any more, and does not wait for the one that is being made.
TEST(VolumeJobs, EndWithTheServer) {
  VolumeStage stage;
  const std::uint32_t volume = stage.subscribe_volume(stage.watcher),
                      plane = stage.subscribe_volume(stage.watcher, true);
  ASSERT_TRUE(stage.shows(volume, 0));
  ASSERT_TRUE(stage.shows(plane, 0));
  stage.volume_gate.close();
  stage.plane_gate.close();
  stage.pose(1);
  ASSERT_TRUE(stage.shows(stage.mesh, 1));
  stage.session->stop_volumes();
  stage.volume_gate.open();
  stage.plane_gate.open();
  stage.executor.drain(Service::volumes);
  stage.executor.drain(Service::planes);
  stage.pose(2);
  ASSERT_TRUE(stage.shows(stage.mesh, 2));
  stage.wait(milliseconds(150));
  EXPECT_EQ(stage.watcher.poses(volume), Poses({0}));
  EXPECT_EQ(stage.watcher.poses(plane), Poses({0}));
  stage.session->leave(stage.watcher, false);
  EXPECT_TRUE(stage.session->waiting().has_value()) << "a job is still under way";
}

// The same of one that nobody watches any more.
TEST(VolumeJobs, EndWhereNobodyWatches) {
  VolumeStage stage;
  stage.volume_gate.close();
  const std::uint32_t volume = stage.subscribe_volume(stage.watcher);
  stage.wait(milliseconds(20));
  const std::string figures = stage.metrics.text();
  stage.session->unsubscribe(stage.watcher, volume);
  stage.volume_gate.open();
  stage.executor.drain(Service::volumes);
  stage.wait(milliseconds(20));
  EXPECT_EQ(stage.metrics.text(), figures) << "a frame was made";
}

// However a volume is made, a stop ends it where it is, and there is no frame; the next one holds everything.
TEST(VolumeJobs, EndInTheirMidst) {
  const Model toy = test::toy_model();
  const auto model = std::make_shared<const ServedModel>("toy", std::make_shared<const Model>(toy));
  const MemoryBudget memory(1 << 30, 1 << 30);
  for (const bool by_spheres : {false, true}) {
    for (const bool plane : {false, true}) {
      SCOPED_TRACE(std::string(by_spheres ? "spheres" : "tets") + (plane ? ", a plane" : ""));
      VolumeSpec spec;
      spec.by_spheres = by_spheres;
      spec.changed_bricks = !plane;
      if (plane) spec.slices.emplace_back().size = {16, 16, 1};
      PoseJob job;
      job.model = model;
      job.request.pose = Pose::rest(toy.segment_count());
      job.volume_voxels = std::uint64_t{1} << 28;
      job.memory = &memory;
      Subscription& shown = job.subscriptions.emplace_back();
      shown.id = 1;
      shown.spec = spec;
      shown.volume = std::make_shared<VolumeStream>(spec, rest_voxels(toy, spec));
      std::vector<PosedFrame> frames;
      job.on_frame = [&](PosedFrame frame) { frames.push_back(std::move(frame)); };
      std::stop_source stop;
      job.stop = stop.get_token();
      for (job.number = 1; job.number <= 2; ++job.number) {
        job.on_outcome = [&](const PoseOutcome&) {
          if (job.number == 2) stop.request_stop();  // once it is posed
        };
        EXPECT_EQ(run(job).code, job.number == 2 ? StatusCode::cancelled : StatusCode::ok);
        ASSERT_EQ(frames.size(), 1U);
      }
      EXPECT_EQ(run(job).code, StatusCode::cancelled);  // not begun at all
      ASSERT_EQ(frames.size(), 1U);
      job.stop = {};
      EXPECT_EQ(run(job).code, StatusCode::ok);
      ASSERT_EQ(frames.size(), 2U);
      EXPECT_EQ(frames[1].keyframe, plane ? 0 : job.number);
      EXPECT_EQ(frames[1].bytes->payload_bytes(), frames[0].bytes->payload_bytes());
    }
  }
}

// Without room for frames whoever has had some gets more, and whoever has not waits.
TEST(VolumeJobs, FirstOnesWaitForMemory) {
  VolumeStage stage;
  const std::uint32_t volume = stage.subscribe_volume(stage.watcher);
  ASSERT_TRUE(stage.shows(volume, 0));
  auto all = std::make_unique<MemoryBudget::Reservation>(stage.memory, std::uint64_t{2} << 30);
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
  stage.session->recorder().start(
      std::make_shared<Recording>("bow", *stage.model, "test", std::size_t{1} << 20));
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
  stage.session->recorder().start(nullptr);
  stage.pose(6);
  EXPECT_TRUE(stage.shows(volume, 6));
}

}  // namespace
}  // namespace ecorche::server
