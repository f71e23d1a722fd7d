// SPDX-License-Identifier: Apache-2.0
// Every pose in a recording has all of its frames, whenever it begins or ends.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>

#include "proto/recording.hpp"
#include "runtime/server/net/tls.hpp"
#include "runtime/server/session/recording.hpp"
#include "tests/unit/server/session_stage.hpp"

namespace ecorche::server {
namespace {

// The recording, ended, as a reader of its file finds it.
wire::RecordedSession whole(Recording& recording) {
  const auto path = std::filesystem::temp_directory_path() / ("ecorche_frames_" + random_token());
  recording.finish();
  RecordingFile file(path);
  file.append(recording.take());
  EXPECT_TRUE(file.commit().ok());
  std::string bytes;
  {
    std::ifstream written(path, std::ios::binary);
    bytes = {std::istreambuf_iterator<char>(written), {}};
  }
  std::filesystem::remove(path);
  wire::RecordedSession session;
  const Status status = wire::read_recording(std::as_bytes(std::span(bytes)), session);
  EXPECT_TRUE(status.ok()) << status.message;
  return session;
}

// A body whose skin and CT are watched.
struct RecordedStage : Stage {
  RecordedStage() : volume(subscribe_volume(watcher)) {
    run_until([this] { return shows(mesh, 0) && shows(volume, 0); });
    wait(milliseconds(20));  // a pose is taken up at once
  }
  bool shows(std::uint32_t subscription, std::uint64_t pose) const {
    const std::vector<std::uint64_t> poses = watcher.poses(subscription);
    return !poses.empty() && poses.back() == pose;
  }
  std::shared_ptr<Recording> recording() const {
    return std::make_shared<Recording>("bow", *model, "test", std::size_t{1} << 20);
  }
  // Until its mesh was shown, and no step more.
  void show_mesh(std::uint64_t pose) {
    for (int i = 0; i < 2000 && !shows(mesh, pose); ++i) {
      io.restart();
      io.run_one_for(milliseconds(5));
    }
    ASSERT_TRUE(shows(mesh, pose));
  }
  static constexpr std::uint32_t mesh = 1;
  std::uint32_t volume;
};

// The mesh is on its way, and with it the acknowledgement, and the volume is not: a client may end the
// recording, or go, or begin the next one.
TEST(RecordedFrames, OfTheLastPoseCome) {
  for (const bool leaves : {false, true}) {
    SCOPED_TRACE(leaves);
    RecordedStage stage;
    const auto first = stage.recording(), second = stage.recording();
    stage.session->recorder().start(first);
    stage.pose(1);
    stage.show_mesh(1);
    ASSERT_FALSE(stage.shows(stage.volume, 1));
    bool ended = false;
    if (leaves) stage.session->leave(stage.watcher, true);
    stage.session->recorder().stop([&] { ended = true; });
    EXPECT_FALSE(ended);
    stage.session->recorder().start(second);
    stage.pose(2);
    stage.run_until([&] { return ended; });
    ASSERT_TRUE(ended);
    stage.run_until([&] { return stage.session->poses().present().sequence == 2; });
    stage.workers.drain();
    stage.volume_workers.drain();  // where there is a volume
    stage.wait(milliseconds(20));
    ended = false;
    stage.session->recorder().stop([&] { ended = true; });
    EXPECT_TRUE(ended) << "nothing is under way";
    for (std::uint64_t pose = 1; pose <= 2; ++pose) {
      const wire::RecordedSession session = whole(pose == 1 ? *first : *second);
      ASSERT_EQ(session.steps.size(), 1U);
      EXPECT_EQ(session.steps[0].pose.sequence(), pose);
      EXPECT_EQ(session.steps[0].frames.size(), leaves && pose == 2 ? 0U : 2U);
    }
  }
}

// The pose that was taken up before has frames that nobody looked at.
TEST(RecordedFrames, BeginWithTheNextPose) {
  RecordedStage stage;
  stage.gate.close();
  stage.pose(1);
  const auto recording = stage.recording();
  stage.session->recorder().start(recording);
  stage.gate.open();
  stage.run_until([&] { return stage.shows(stage.mesh, 1); });
  stage.pose(2);
  stage.run_until([&] { return stage.shows(stage.volume, 2); });
  bool ended = false;
  stage.session->recorder().stop([&] { ended = true; });
  stage.run_until([&] { return ended; });
  const wire::RecordedSession session = whole(*recording);
  ASSERT_EQ(session.steps.size(), 1U);
  EXPECT_EQ(session.steps[0].pose.sequence(), 2U);
  EXPECT_EQ(session.steps[0].frames.size(), 2U);
}

// Poses and frames without a session.
struct Recorder {
  explicit Recorder(std::size_t limit) : recording("bow", model, "test", limit) {
    pose.pose = Pose::rest(model.model().segment_count());
    v1::Envelope some;
    some.mutable_mesh_frame();
    frame.bytes = std::make_shared<const wire::EncodedFrame>(wire::encode(some));
    frame.digest = 7;
  }
  void add_pose() {
    ++pose.sequence;
    recording.add(pose);
  }
  void add_frame(std::uint32_t subscription) {
    frame.subscription = subscription;
    recording.add(frame, v1::Subscribe{});
  }
  ServedModel model{"toy", std::make_shared<const Model>(test::toy_model())};
  PoseRequest pose;
  PosedFrame frame;
  Recording recording;
};

TEST(RecordedFrames, APoseThatLacksSomeNeverWas) {
  Recorder recorder(std::size_t{1} << 20);
  recorder.recording.take_back();  // there is none
  recorder.add_pose();
  recorder.add_frame(1);
  recorder.add_frame(2);
  recorder.recording.take_back();
  recorder.recording.take_back();  // once
  recorder.add_frame(2);           // it came late
  recorder.add_pose();
  recorder.add_frame(1);
  recorder.add_pose();
  recorder.add_frame(2);
  recorder.recording.take_back();
  recorder.add_pose();
  recorder.add_frame(2);
  const wire::RecordedSession session = whole(recorder.recording);
  ASSERT_EQ(session.steps.size(), 2U);
  for (std::uint32_t i = 0; i < 2; ++i) {
    EXPECT_EQ(session.steps[i].pose.sequence(), 2 + 2 * i);
    ASSERT_EQ(session.steps[i].frames.size(), 1U);
    EXPECT_EQ(session.steps[i].frames[0].subscription(), 1 + i);
  }
}

// Wherever the limit cuts.
TEST(RecordedFrames, AreAllThereUpToTheLimit) {
  for (std::size_t limit = 2048; limit < 2048 + 512; limit += 16) {
    SCOPED_TRACE(limit);
    Recorder recorder(limit);
    for (int i = 0; i < 100; ++i) {
      recorder.add_pose();
      recorder.add_frame(1);
      recorder.add_frame(2);
    }
    ASSERT_TRUE(recorder.recording.full());
    const wire::RecordedSession session = whole(recorder.recording);
    EXPECT_TRUE(session.full);
    EXPECT_GT(session.steps.size(), 2U);
    for (const wire::RecordedStep& step : session.steps) EXPECT_EQ(step.frames.size(), 2U);
  }
}

}  // namespace
}  // namespace ecorche::server
