// SPDX-License-Identifier: Apache-2.0
// Which frames a job makes, without a session.
#include "runtime/server/session/frame_planner.hpp"

#include <gtest/gtest.h>

#include "runtime/server/session/mesh_stream.hpp"
#include "runtime/server/session/pose_slot.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/fake_member.hpp"

namespace ecorche::server {
namespace {

using Shows = FramePlan::Shows;
using Numbers = std::vector<std::uint32_t>;
using std::chrono::milliseconds;

constexpr std::uint64_t kMuch = std::uint64_t{1} << 30;
constexpr StreamKinds kEvery = kMeshes | kVolumes | kPlanes;

struct Planning {
  explicit Planning(std::uint64_t bytes = kMuch) : memory(bytes, kMuch) {}

  std::uint32_t see(const StreamSpec& spec) {
    return table.add(member, {.id = 0, .spec = spec, .request = {}}, now)->id;
  }
  std::uint32_t see_mesh(double rate = 0, v1::Encoding encoding = v1::ENCODING_F32, bool adaptive = false) {
    MeshSpec spec;
    spec.tissues = {0};
    spec.encoding = encoding;
    spec.max_rate = rate;
    spec.adaptive = adaptive;
    return see(spec);
  }
  FramePlan plan(Shows shows, StreamKinds kinds = kEvery) const {
    return {
        .now = now, .kinds = kinds, .shows = shows, .still = true, .keyframes_at_once = true, .present = 5};
  }
  // Of the next job: what it makes.
  Numbers make(const FramePlan& plan) {
    job = {};
    planner.fill(plan, job);
    Numbers out;
    for (const Subscription& one : job.subscriptions) out.push_back(one.id);
    return out;
  }
  Numbers make(Shows shows, StreamKinds kinds = kEvery) { return make(plan(shows, kinds)); }

  Clock::time_point now{std::chrono::seconds(100)};
  std::shared_ptr<const ServedModel> model =
      std::make_shared<const ServedModel>("toy", std::make_shared<const Model>(test::toy_model()));
  MemoryBudget memory;
  StreamActivity activity;
  SubscriptionTable table{model, memory.kept_pool(), kMuch, [](const std::shared_ptr<const void>&) {}};
  FramePlanner planner{table, model, memory, activity, kMuch};
  FakeMember member;
  PoseJob job;
};

TEST(FramePlannerTest, CountsTheBytesOfAFrame) {
  Planning all;
  const auto vertices = static_cast<std::uint64_t>(all.model->model().tissues[0].V.rows());
  MeshSpec mesh;
  mesh.tissues = {0};
  EXPECT_EQ(all.planner.frame_bytes(mesh), 12 * vertices);
  mesh.encoding = v1::ENCODING_U16;
  EXPECT_EQ(all.planner.frame_bytes(mesh), 6 * vertices);
  const Image& scan = all.model->model().volumes[0].image;
  EXPECT_EQ(all.planner.frame_bytes(VolumeSpec{}), scan.bytes.size());
  VolumeSpec planes;
  planes.slices.emplace_back().size = {30, 20, 1};
  planes.slices.emplace_back().size = {30, 20, 1};
  EXPECT_EQ(all.planner.frame_bytes(planes), 1200 * scalar_bytes(scan.type));
  const FramePlanner small(all.table, all.model, all.memory, all.activity, 10);
  EXPECT_EQ(small.frame_bytes(VolumeSpec{}), 0U) << "nothing is made of it";
}

TEST(FramePlannerTest, ThePresentPoseIsForWhoWaits) {
  Planning all;
  const std::uint32_t mesh = all.see_mesh(), volume = all.see(VolumeSpec{});
  EXPECT_TRUE(all.planner.anything(all.plan(Shows::present)));
  EXPECT_EQ(all.make(Shows::present, kMeshes), Numbers{mesh});
  EXPECT_GT(all.memory.bytes(), 0U) << "what the job will take is counted";
  EXPECT_FALSE(all.planner.anything(all.plan(Shows::present, kMeshes))) << "once";
  EXPECT_EQ(all.make(Shows::present), Numbers{volume});
  EXPECT_TRUE(all.make(Shows::present).empty());
  EXPECT_EQ(all.memory.bytes(), 0U);
}

TEST(FramePlannerTest, TheNextPoseIsForAllWhoAreDue) {
  Planning all;
  const std::uint32_t always = all.see_mesh(), rated = all.see_mesh(10);
  EXPECT_EQ(all.make(Shows::next), (Numbers{always, rated}));
  EXPECT_EQ(all.make(Shows::next), (Numbers{always, rated})) << "the first was late";
  all.now += milliseconds(50);
  EXPECT_EQ(all.make(Shows::next), Numbers{always});
  EXPECT_EQ(all.table.next_due(), all.now + milliseconds(50)) << "shown without another pose";
  all.now += milliseconds(50);
  EXPECT_EQ(all.make(Shows::next), (Numbers{always, rated}));
}

TEST(FramePlannerTest, NothingIsMadeForWhoDoesNotRead) {
  Planning all;
  const std::uint32_t mesh = all.see_mesh();
  all.member.reads = false;
  EXPECT_TRUE(all.make(Shows::present).empty());
  EXPECT_TRUE(all.planner.take_unread());
  EXPECT_FALSE(all.planner.take_unread()) << "once";
  all.member.reads = true;
  EXPECT_EQ(all.make(Shows::next), Numbers{mesh});
  EXPECT_FALSE(all.planner.take_unread());
  all.member.reads = false;
  EXPECT_TRUE(all.make(Shows::next).empty());
  EXPECT_TRUE(all.planner.take_unread());
  all.member.reads = true;
  EXPECT_EQ(all.make(Shows::present), Numbers{mesh}) << "it waits for the pose that it missed";
}

// First ones, as many as there is memory for; who has had some gets more.
TEST(FramePlannerTest, FirstFramesWaitForMemory) {
  Planning all(1);
  const std::uint32_t first = all.see_mesh();
  all.see_mesh(1000);
  EXPECT_EQ(all.make(Shows::present), Numbers{first});
  EXPECT_TRUE(all.activity.patience(all.now)) << "somebody waits for memory";
  const PoseJob holds = std::move(all.job);
  EXPECT_FALSE(all.planner.anything(all.plan(Shows::present)));
  EXPECT_EQ(all.make(Shows::next), Numbers{first});
  EXPECT_TRUE(all.make(Shows::newest).empty());
  all.table.wait(kMeshes, all.now, all.now, false);
  EXPECT_TRUE(all.make(Shows::present).empty());
  EXPECT_EQ(all.make(Shows::newest), Numbers{first}) << "had one, and is behind";
}

TEST(FramePlannerTest, WhoIsBehindIsServedSinceTheFirstWait) {
  Planning all;
  all.see(VolumeSpec{});
  const auto begun = all.now;
  all.now += milliseconds(30);
  VolumeSpec packed;
  packed.compressed = true;
  all.see(packed);
  all.job.request.arrived = all.now;
  all.planner.fill(all.plan(Shows::newest, kVolumes), all.job);
  EXPECT_EQ(all.job.subscriptions.size(), 2U);
  EXPECT_EQ(all.job.request.arrived, begun);
}

TEST(FramePlannerTest, MembersAreAskedForTheirLevelAndSeeAllOfAStillBody) {
  Planning all;
  all.see_mesh(0, v1::ENCODING_F32, true);
  all.member.level = 2;
  FramePlan moving = all.plan(Shows::next);
  moving.still = false;
  EXPECT_EQ(all.make(moving).size(), 1U);
  EXPECT_EQ(all.job.subscriptions[0].levels, 4U);
  EXPECT_EQ(all.table.next_due(), all.now + PoseSlot::still_after);
  all.now += PoseSlot::still_after;
  all.table.wake(all.now);
  EXPECT_EQ(all.make(Shows::present).size(), 1U);
  EXPECT_EQ(all.job.subscriptions[0].levels, 1U);
  EXPECT_FALSE(all.table.next_due());
}

TEST(FramePlannerTest, ABodyWhosePosesMayOnlyBeLateDoesNotStandStillYet) {
  Planning all;
  all.see_mesh(0, v1::ENCODING_F32, true);
  all.member.level = 2;
  all.member.gap = std::chrono::milliseconds(200);
  const Clock::time_point moved = all.now;
  FramePlan moving = all.plan(Shows::next);
  moving.still = false;
  all.make(moving);
  EXPECT_EQ(all.table.next_due(), moved + PoseSlot::still_after + all.member.gap);
  // Shown again for another reason, it is as coarse as before.
  all.now = moved + PoseSlot::still_after;
  all.table.rows().front().wait(all.now);
  FramePlan again = all.plan(Shows::present);
  again.moved = moved;
  EXPECT_EQ(all.make(again).size(), 1U);
  EXPECT_EQ(all.job.subscriptions[0].levels, 4U);
  EXPECT_EQ(all.table.next_due(), moved + PoseSlot::still_after + all.member.gap);
  all.now = *all.table.next_due();
  all.table.wake(all.now);
  again.now = all.now;
  EXPECT_EQ(all.make(again).size(), 1U);
  EXPECT_EQ(all.job.subscriptions[0].levels, 1U);
}

// Of the same tissues: within a stream any, of the pose that is shown again only its own.
TEST(FramePlannerTest, TellsTheQualityThatIsKnown) {
  Planning all;
  const auto quality = std::make_shared<v1::PoseQuality>();
  quality->set_pose_sequence(4);
  const std::uint32_t known = all.see_mesh();
  all.make(Shows::present);
  EXPECT_EQ(all.job.subscriptions[0].quality, nullptr);
  all.table.find(known)->subscription.quality = quality;
  all.see_mesh(0, v1::ENCODING_U16);
  all.make(Shows::present);
  EXPECT_EQ(all.job.subscriptions[0].quality, nullptr) << "of the pose before";
  all.make(Shows::next);
  ASSERT_EQ(all.job.subscriptions.size(), 2U);
  EXPECT_EQ(all.job.subscriptions[1].quality, quality);
  quality->set_pose_sequence(5);
  all.see_mesh(1000);
  all.make(Shows::present);
  EXPECT_EQ(all.job.subscriptions[0].quality, quality);
}

TEST(FramePlannerTest, AFrameOfTheRestPoseShowsWhatIsThere) {
  Planning all;
  const auto positions = std::make_shared<const Positions>();
  all.model->rest_pose.know({0}, positions);
  all.see_mesh();
  FramePlan rest = all.plan(Shows::present);
  rest.present = 0;
  all.make(rest);
  EXPECT_EQ(all.job.subscriptions[0].rest, positions);
  all.see_mesh(1000);
  all.make(Shows::present);
  EXPECT_EQ(all.job.subscriptions[0].rest, nullptr) << "another pose";
}

TEST(FramePlannerTest, KeyframesAreMadeWithTheirDistance) {
  Planning all;
  const std::uint32_t id = all.see_mesh(0, v1::ENCODING_U16_DELTA);
  FramePlan next = all.plan(Shows::next);
  next.keyframes_at_once = false;
  all.make(next);
  EXPECT_NE(all.job.subscriptions[0].keyframes & 1, 0U);
  all.table.find(id)->subscription.keyframes = 1;  // somebody has come
  all.make(next);
  EXPECT_EQ(all.job.subscriptions[0].keyframes, 0U);
  EXPECT_EQ(all.table.next_due(), all.now + SubscriptionRow::keyframe_pause);
}

}  // namespace
}  // namespace ecorche::server
