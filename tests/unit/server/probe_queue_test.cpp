// SPDX-License-Identifier: Apache-2.0
// Who waits for a posed body to ask, without a session.
#include "runtime/server/session/probe_queue.hpp"

#include <gtest/gtest.h>

namespace ecorche::server {
namespace {

using std::chrono::milliseconds;

struct Probing {
  explicit Probing(std::uint64_t frames = 10) : kept(std::make_shared<const Pool>(frames * 100)) {}
  // The next answer, or nothing yet.
  void ask(bool many = false) {
    queue.ask(
        [this](const std::shared_ptr<const ProbeFrame>& frame, const Status& status) {
          ++answers;
          last = frame;
          why = status.code;
        },
        many, now);
  }
  // A job makes it.
  std::shared_ptr<ProbeFrame> make(bool new_pose = false) {
    const auto frame = queue.frame_for_job(new_pose, now);
    if (frame) queue.fill(frame);
    return frame;
  }
  Clock::time_point now{std::chrono::seconds(100)};
  std::shared_ptr<const Pool> kept;
  std::vector<std::shared_ptr<const void>> gone;
  ProbeQueue queue{100, kept, [this](std::shared_ptr<const void> what) { gone.push_back(std::move(what)); }};
  int answers = 0;
  std::shared_ptr<const ProbeFrame> last;
  StatusCode why = StatusCode::ok;
};

TEST(ProbeQueueTest, AnswersOnceAJobHasMadeItAndThenAtOnce) {
  Probing probing;
  EXPECT_FALSE(probing.make()) << "nobody asks";
  probing.ask();
  probing.ask();
  EXPECT_EQ(probing.answers, 0);
  EXPECT_TRUE(probing.queue.anybody_waits());
  const auto frame = probing.make();
  ASSERT_TRUE(frame);
  EXPECT_EQ(probing.answers, 2);
  EXPECT_EQ(probing.last, frame);
  EXPECT_FALSE(probing.queue.anybody_waits());
  probing.ask();
  EXPECT_EQ(probing.answers, 3);
  EXPECT_EQ(probing.kept->bytes(), 100U);
}

// For a second every pose is made ready for the next question; then what was made is of an older pose.
TEST(ProbeQueueTest, PosesAreMadeReadyWhileSomebodyAsks) {
  Probing probing;
  probing.ask(true);
  EXPECT_TRUE(probing.queue.many(probing.now));
  probing.make();
  probing.now += milliseconds(999);
  EXPECT_TRUE(probing.queue.many(probing.now));
  EXPECT_TRUE(probing.make(true));
  probing.now += milliseconds(1);
  EXPECT_FALSE(probing.queue.many(probing.now));
  EXPECT_FALSE(probing.make(false));
  EXPECT_TRUE(probing.queue.present()) << "the same pose is shown again";
  EXPECT_FALSE(probing.make(true));
  EXPECT_FALSE(probing.queue.present());
  probing.ask();
  EXPECT_TRUE(probing.queue.anybody_waits());
}

// The one that is shown and the one being made are two; a third only where an old one is still being asked.
TEST(ProbeQueueTest, FramesAreFilledAgainOnceNobodyAsksThem) {
  Probing probing;
  probing.ask();
  const ProbeFrame* const first = probing.make().get();
  const ProbeFrame* const second = probing.make(true).get();
  EXPECT_NE(first, second);
  probing.last = nullptr;
  EXPECT_EQ(probing.make(true).get(), first);
  probing.ask();  // of the first
  EXPECT_EQ(probing.make(true).get(), second);
  const ProbeFrame* const third = probing.make(true).get();
  EXPECT_NE(third, first) << "somebody still asks it";
  EXPECT_NE(third, second) << "it is shown";
  EXPECT_EQ(probing.kept->bytes(), 300U);
}

TEST(ProbeQueueTest, WithoutMemoryWhoWaitsIsToldSo) {
  Probing probing(1);
  probing.ask();
  const auto held = probing.make();
  ASSERT_TRUE(held);
  EXPECT_FALSE(probing.make(true)) << "the only one is asked";
  probing.ask();
  EXPECT_FALSE(probing.make(true));
  EXPECT_TRUE(probing.queue.anybody_waits());
  probing.queue.fail({StatusCode::resource_exhausted, "full"});
  EXPECT_EQ(probing.why, StatusCode::resource_exhausted);
  EXPECT_FALSE(probing.last);
  EXPECT_FALSE(probing.queue.anybody_waits());
}

TEST(ProbeQueueTest, FramesAreLetGoOfWhenNobodyAsks) {
  Probing probing;
  probing.ask();
  probing.queue.forget(false, probing.now);
  EXPECT_TRUE(probing.queue.anybody_waits()) << "somebody still does";
  probing.make();
  probing.now += milliseconds(9999);
  probing.queue.forget(true, probing.now);
  EXPECT_TRUE(probing.gone.empty());
  probing.now += milliseconds(1);
  probing.queue.forget(true, probing.now);
  EXPECT_EQ(probing.gone.size(), 1U);
  EXPECT_FALSE(probing.queue.present());
  probing.ask();
  probing.make();
  probing.queue.forget(false, probing.now);  // everybody has left
  EXPECT_EQ(probing.gone.size(), 2U);
  probing.gone.clear();
  probing.last = nullptr;
  EXPECT_EQ(probing.kept->bytes(), 0U);
}

}  // namespace
}  // namespace ecorche::server
