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

 private:
  bool deliver(const PosedFrame& frame) override {
    judged_.push_back(frame.judged != nullptr);
    return true;
  }
  std::uint32_t ask_level(std::uint32_t, std::uint32_t finest, std::uint32_t, bool) override {
    return finest;
  }
  void pose_done(const PoseOutcome&, const Skipped&) override {}
  void control_changed(v1::Role, bool) override {}
  void model_changed(std::uint64_t) override {}

  std::vector<bool> judged_;
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

TEST(Session, APoseAfterARestIsJudgedOnItsWayAndOneInAStreamIsNot) {
  Stage stage;
  EXPECT_EQ(stage.next_is_judged(), true) << "the first frame of a subscription";
  stage.wait(kLong);
  stage.pose(1);
  EXPECT_EQ(stage.next_is_judged(), true) << "after a rest";
  stage.wait(kShort);
  stage.pose(2);
  EXPECT_EQ(stage.next_is_judged(), false) << "right behind another";
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

// Nor does one that comes when the last frame has only just been made, long after its pose was sent.
TEST(Session, ARestBeginsWithTheEndOfTheLastFrame) {
  Stage stage;
  ASSERT_EQ(stage.next_is_judged(), true);
  stage.wait(kLong);
  stage.gate.close();
  stage.pose(1);
  stage.wait(kLong);
  stage.gate.open();
  EXPECT_EQ(stage.next_is_judged(), true);
  stage.wait(kShort);
  stage.pose(2);
  EXPECT_EQ(stage.next_is_judged(), false);
}

}  // namespace
}  // namespace ecorche::server
