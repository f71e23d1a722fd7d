// SPDX-License-Identifier: Apache-2.0
// What poses are worth, without a session.
#include "runtime/server/session/quality_tracker.hpp"

#include <gtest/gtest.h>

#include "tests/support/toy_model.hpp"
#include "tests/unit/server/fake_member.hpp"

namespace ecorche::server {
namespace {

struct Tracking {
  SubscriptionRow& see(bool quality_with_frames = false) {
    MeshSpec spec;
    spec.tissues = {0};
    spec.quality = quality_with_frames;
    const std::uint32_t id = table.add(member, {.id = 0, .spec = spec, .request = {}}, now)->id;
    for (SubscriptionRow& row : table.rows()) row.begin_frame(now);
    return *table.find(id);
  }
  // A frame of the pose, measured by the thresholds.
  static PosedFrame frame(std::uint64_t pose, const runtime::QualityThresholds& thresholds = {}) {
    runtime::PoseQuality quality;
    quality.thresholds = thresholds;
    PosedFrame out;
    out.judged = std::make_shared<const v1::PoseQuality>(describe(quality, {}, pose));
    return out;
  }

  Clock::time_point now{std::chrono::seconds(100)};
  std::shared_ptr<const ServedModel> model =
      std::make_shared<const ServedModel>("toy", std::make_shared<const Model>(test::toy_model()));
  net::io_context io;
  Workers workers{1, [](const Job& job) { job(); }};
  Executor executor{io, workers};
  TurnQueue turns{io, TurnQueue::Order::first_come};
  MemoryBudget memory{std::uint64_t{1} << 30, std::uint64_t{1} << 30};
  SubscriptionTable table{model, memory.kept_pool(), std::uint64_t{1} << 30,
                          [](const std::shared_ptr<const void>&) {}};
  PoseSlot poses{Pose::rest(model->model().segment_count())};
  int shown = 0;
  QualityTracker tracker{executor, turns, table, poses, model, [this] { ++shown; }};
  FakeMember member;
};

TEST(QualityTrackerTest, KeepsWhatWasMeasuredByPresentThresholds) {
  Tracking all;
  SubscriptionRow& row = all.see();
  EXPECT_FALSE(all.tracker.take_unmeasured());
  const PosedFrame first = Tracking::frame(0);
  all.tracker.frame_made(first, row);
  EXPECT_EQ(row.subscription.quality, first.judged);
  EXPECT_EQ(all.model->rest_pose.quality({0}, {}), first.judged) << "of the rest pose for all sessions";
  EXPECT_FALSE(all.tracker.take_unmeasured());
  const runtime::QualityThresholds strict{.max_volume_change = 1e-9};
  all.tracker.set_thresholds(strict, all.now);
  EXPECT_EQ(row.subscription.quality, nullptr);
  all.tracker.frame_made(first, row);
  EXPECT_EQ(row.subscription.quality, nullptr) << "by thresholds that are others by now";
  EXPECT_TRUE(all.tracker.take_unmeasured());
  EXPECT_FALSE(all.tracker.take_unmeasured()) << "once";
  const PosedFrame second = Tracking::frame(0, strict);
  all.tracker.frame_made(second, row);
  EXPECT_EQ(row.subscription.quality, second.judged);
  PoseRequest moved;
  moved.sequence = 1;
  all.poses.show(moved);
  all.tracker.frame_made({}, row);
  EXPECT_TRUE(all.tracker.take_unmeasured()) << "its quality is that of another pose";
}

TEST(QualityTrackerTest, OtherThresholdsAreToldToWhoWantsQualityWithFrames) {
  Tracking all;
  all.see();
  all.tracker.set_thresholds({.max_volume_change = 0.5}, all.now);
  EXPECT_FALSE(all.table.anybody_waits());
  all.see(true);
  all.tracker.set_thresholds({.max_volume_change = 0.6}, all.now);
  EXPECT_TRUE(all.table.anybody_waits());
  EXPECT_EQ(all.tracker.thresholds().max_volume_change, 0.6);
}

TEST(QualityTrackerTest, ShowsAPoseAgainOfWhichAFrameCouldNotTellAll) {
  Tracking all;
  SubscriptionRow& row = all.see();
  runtime::PoseQuality quality;
  quality.overlap_pending = true;
  PosedFrame frame;
  frame.judged = std::make_shared<const v1::PoseQuality>(describe(quality, {}, 0));
  all.tracker.frame_made(frame, row);
  EXPECT_EQ(row.subscription.quality, frame.judged);
  EXPECT_TRUE(all.tracker.take_unmeasured());
  const auto turn =
      std::make_shared<Turn>([&] { return all.tracker.measure(nullptr); }, std::make_shared<Account>());
  all.turns.ask(turn);
  all.io.run();
  EXPECT_FALSE(row.subscription.quality->overlap_pending());
  EXPECT_TRUE(all.table.anybody_waits());
  EXPECT_EQ(all.shown, 1);
}

TEST(QualityTrackerTest, MeasuresThePresentPoseInItsTurn) {
  Tracking all;
  EXPECT_FALSE(all.tracker.measure(nullptr)) << "nobody sees it";
  SubscriptionRow& row = all.see();
  auto owner = std::make_shared<int>(0);
  const std::weak_ptr<int> kept = owner;
  const auto account = std::make_shared<Account>();
  int turns = 0;
  const auto turn = std::make_shared<Turn>(
      [&] {
        ++turns;
        return all.tracker.measure(std::exchange(owner, nullptr));
      },
      account);
  const auto next = std::make_shared<Turn>([&] { return ++turns == 0; }, account);
  all.turns.ask(turn);
  all.turns.ask(next);
  EXPECT_EQ(turns, 1);
  EXPECT_FALSE(kept.expired());
  all.io.run();
  EXPECT_EQ(turns, 2) << "the next has its turn";
  EXPECT_TRUE(kept.expired());
  ASSERT_TRUE(row.subscription.quality);
  EXPECT_EQ(row.subscription.quality->pose_sequence(), 0U);
  EXPECT_EQ(row.subscription.quality->verdict(), v1::PoseQuality::VERDICT_PASS);
  EXPECT_EQ(all.shown, 0) << "the next frame tells it";
}

}  // namespace
}  // namespace ecorche::server
