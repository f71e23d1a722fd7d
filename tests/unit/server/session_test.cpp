// SPDX-License-Identifier: Apache-2.0
// A session without a server: which poses it takes to come after a rest.
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <vector>

#include "proto/framing.hpp"
#include "runtime/server/session.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::server {
namespace {

using std::chrono::milliseconds;

// Keeps of every frame that it is shown whether its own quality came with it.
class Watcher final : public Member {
 public:
  const std::vector<bool>& judged() const { return judged_; }
  Clock::time_point last() const { return last_; }

 private:
  bool deliver(const PosedFrame& frame) override {
    judged_.push_back(frame.judged != nullptr);
    last_ = Clock::now();
    return true;
  }
  std::uint32_t ask_level(std::uint32_t, std::uint32_t finest, std::uint32_t, bool) override {
    return finest;
  }
  void pose_done(const PoseOutcome&, const Skipped&) override {}
  void control_changed(v1::Role, bool) override {}
  void model_changed(std::uint64_t) override {}

  std::vector<bool> judged_;
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
  Stage()
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

}  // namespace
}  // namespace ecorche::server
