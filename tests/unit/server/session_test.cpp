// SPDX-License-Identifier: Apache-2.0
// A session without a server: which poses it takes to come after a rest, when it makes keyframes, when
// judges.
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "proto/framing.hpp"
#include "runtime/server/session.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::server {
namespace {

using std::chrono::milliseconds;

// Keeps of every frame that it is shown whether its own quality came with it, and whether it is a keyframe.
class Watcher final : public Member {
 public:
  const std::vector<bool>& judged() const { return judged_; }
  const std::vector<bool>& keyframes() const { return keyframes_; }
  // As if it had not got what the next frame is against.
  void lose_next() { loses_ = true; }
  Clock::time_point last() const { return last_; }

 private:
  bool deliver(const PosedFrame& frame) override {
    judged_.push_back(frame.judged != nullptr);
    keyframes_.push_back(frame.keyframe == frame.number);
    last_ = Clock::now();
    return !std::exchange(loses_, false);
  }
  std::uint32_t ask_level(std::uint32_t, std::uint32_t finest, std::uint32_t, bool) override {
    return finest;
  }
  void pose_done(const PoseOutcome&, const Skipped&) override {}
  void control_changed(v1::Role, bool) override {}
  void model_changed(std::uint64_t) override {}

  std::vector<bool> judged_, keyframes_;
  bool loses_ = false;
  Clock::time_point last_{};
};

// A worker that can be kept from its jobs.
class Gate {
 public:
  void close() { set(false); }
  void open() { set(true); }
  void pass() {
    std::unique_lock lock(mutex_);
    opened_.wait(lock, [this] { return open_; });
  }

 private:
  void set(bool open) {
    const std::lock_guard lock(mutex_);
    open_ = open;
    opened_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable opened_;
  bool open_ = true;
};

struct Stage {
  explicit Stage(v1::Encoding encoding = v1::ENCODING_F32)
      : model(std::make_shared<const ServedModel>("toy", std::make_shared<const Model>(test::toy_model()))),
        workers(1,
                [this](const Job& job) {
                  gate.pass();
                  job();
                }),
        session(std::make_shared<Session>(io, workers, model, "a", true, limits, memory, judging, metrics)) {
    session->join(watcher);
    MeshWant want;
    want.tissues = {0};
    want.encoding = encoding;
    session->subscribe(watcher, {.id = 0, .want = want, .request = {}});
  }
  ~Stage() {
    gate.open();
    session->leave(watcher, false);
    judging.stop();
    run_until([] { return false; }, milliseconds(50));
    session.reset();
  }

  void pose(std::uint64_t sequence) {
    PoseRequest request;
    request.sequence = sequence;
    request.pose = Pose::rest(model->model().segment_count());
    request.pose.root_translation.x() = static_cast<double>(sequence);
    session->pose(std::move(request));
  }
  template <class Done>
  void run_until(Done&& done, Clock::duration most = std::chrono::seconds(20)) {
    const auto until = Clock::now() + most;
    while (!done() && Clock::now() < until) {
      io.restart();
      io.run_for(milliseconds(5));
    }
  }
  void wait(milliseconds time) {
    run_until([] { return false; }, time);
  }
  // Whether the next frame came with its own quality, measured for it.
  std::optional<bool> next_is_judged() {
    run_until([&] { return watcher.judged().size() > seen; });
    if (watcher.judged().size() == seen) return std::nullopt;
    return watcher.judged()[seen++];
  }

  // So short after the last frame that nothing is a rest yet, however busy the machine is.
  bool in_time() const { return Clock::now() - watcher.last() < milliseconds(100); }

  net::io_context io;
  Limits limits;
  FrameMemory memory{std::uint64_t{1} << 30};
  Judging judging{io};
  Metrics metrics;
  Gate gate;
  std::shared_ptr<const ServedModel> model;
  Workers workers;
  Watcher watcher;
  std::size_t seen = 0;  // of its frames
  std::shared_ptr<Session> session;
};

constexpr milliseconds kLong{250}, kShort{5};
constexpr int kTrials = 10;

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
  const auto own = std::make_shared<Session>(stage.io, stage.workers, stage.model, "-1", false, stage.limits,
                                             stage.memory, stage.judging, stage.metrics);
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
