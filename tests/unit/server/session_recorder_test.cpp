// SPDX-License-Identifier: Apache-2.0
// What goes into a recording, pose by pose, without a session.
#include "runtime/server/session/session_recorder.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "proto/recording.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::server {
namespace {

struct Taping {
  ServedModel model{"toy", std::make_shared<const Model>(test::toy_model())};
  std::shared_ptr<Recording> recording =
      std::make_shared<Recording>("bow", model, "test", std::size_t{1} << 20);
  SessionRecorder recorder;
  std::uint64_t number = 0;

  void begin(std::map<std::uint32_t, v1::Subscribe> requests = {{7, {}}}) {
    ++number;
    recorder.begin_pose(std::move(requests));
  }
  void pose() {
    PoseRequest request;
    request.sequence = number;
    request.pose = Pose::rest(model.model().segment_count());
    recorder.add_pose(request, number);
  }
  void frame(std::uint32_t subscription = 7, std::uint64_t keyframe = 0) {
    wire::EncodedFrame bytes;
    recorder.add_frame({.subscription = subscription,
                        .level = 0,
                        .number = number,
                        .keyframe = keyframe,
                        .encoded = 0,
                        .bytes = std::make_shared<const wire::EncodedFrame>(std::move(bytes)),
                        .digest = 1});
  }
  wire::RecordedSession read() {
    recording->finish();
    const std::string bytes = recording->take();
    wire::RecordedSession out;
    EXPECT_TRUE(wire::read_recording(std::as_bytes(std::span(bytes)), out).ok());
    return out;
  }
};

TEST(SessionRecorderTest, AddsPosesWithTheFramesThatWereAskedForAsTheyBegan) {
  Taping one;
  one.begin();
  one.pose();
  one.frame();
  one.recorder.end_pose(true);
  EXPECT_FALSE(one.recorder.running());
  EXPECT_EQ(one.recording->poses(), 0U) << "it ran not yet";
  one.recorder.start(one.recording);
  EXPECT_TRUE(one.recorder.running());
  one.begin();
  one.frame();  // of no pose yet
  one.pose();
  one.frame();
  one.frame(8);              // nobody had asked
  one.frame(7, one.number);  // a keyframe, for others
  --one.number;
  one.frame();  // of the pose before
  ++one.number;
  one.recorder.end_pose(true);
  one.frame();  // too late
  const wire::RecordedSession read = one.read();
  ASSERT_EQ(read.steps.size(), 1U);
  EXPECT_EQ(read.steps[0].frames.size(), 1U);
}

TEST(SessionRecorderTest, APoseWithoutAllOfItsFramesNeverWas) {
  Taping one;
  one.recorder.start(one.recording);
  one.begin();
  one.pose();
  one.frame();
  one.recorder.end_pose(true);
  one.begin();
  one.pose();
  one.frame();
  one.recorder.end_pose(false);
  one.begin();
  one.recorder.end_pose(false);  // it was not posed at all
  EXPECT_EQ(one.read().steps.size(), 1U);
}

// The recording ends with the pose that is being made, and another may begin meanwhile.
TEST(SessionRecorderTest, EndsWithThePoseUnderWay) {
  Taping one;
  bool ended = false;
  one.recorder.start(one.recording);
  one.recorder.stop([&] { ended = true; });
  EXPECT_TRUE(ended) << "nothing was being made";
  EXPECT_FALSE(one.recorder.recording());
  ended = false;
  one.recorder.start(one.recording);
  one.begin();
  one.recorder.stop([&] { ended = true; });
  EXPECT_FALSE(one.recorder.running());
  const auto other = std::make_shared<Recording>("nod", one.model, "test", std::size_t{1} << 20);
  one.recorder.start(other);
  one.pose();
  one.frame();
  EXPECT_FALSE(ended);
  one.recorder.end_pose(true);
  EXPECT_TRUE(ended);
  EXPECT_EQ(one.recording->poses(), 1U);
  EXPECT_EQ(other->poses(), 0U);
}

TEST(SessionRecorderTest, WhatFailsAtTheEndLeavesTheNextPoseAlone) {
  Taping one;
  one.recorder.start(one.recording);
  one.begin();
  one.pose();
  one.recorder.stop([] { throw std::runtime_error("no file"); });
  EXPECT_THROW(one.recorder.end_pose(true), std::runtime_error);
  one.recorder.end_pose(true);
  one.recorder.start(one.recording);
  one.begin();
  one.pose();
  one.recorder.end_pose(true);
  EXPECT_EQ(one.recording->poses(), 2U);
}

}  // namespace
}  // namespace ecorche::server
