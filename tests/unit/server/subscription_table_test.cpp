// SPDX-License-Identifier: Apache-2.0
// Who sees what, and when each is due, without a session.
#include "runtime/server/session/subscription_table.hpp"

#include <gtest/gtest.h>

#include "runtime/server/session/retained_bytes.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/fake_member.hpp"

namespace ecorche::server {
namespace {

using std::chrono::milliseconds;

SubscriptionRequest mesh_of_skin(double rate = 0, v1::Encoding encoding = v1::ENCODING_F32) {
  MeshSpec spec;
  spec.tissues = {0};
  spec.encoding = encoding;
  spec.max_rate = rate;
  return {.id = 0, .spec = spec, .request = {}};
}

SubscriptionRequest scan_request(bool plane = false) {
  VolumeSpec spec;
  if (plane) spec.slices.emplace_back().size = {16, 16, 1};
  return {.id = 0, .spec = spec, .request = {}};
}

struct Seats {
  explicit Seats(std::uint64_t kept_bytes = std::uint64_t{1} << 30)
      : kept(std::make_shared<const Pool>(kept_bytes)) {}
  std::uint32_t add(Member& member, const SubscriptionRequest& request) {
    const Subscription* const made = table.add(member, request, now);
    return made ? made->id : 0;
  }
  SubscriptionRow& row(std::uint32_t id) { return *table.find(id); }
  // As if everybody had what they wait for.
  void serve() {
    for (SubscriptionRow& row : table.rows()) row.begin_frame(now);
  }

  std::shared_ptr<const ServedModel> model =
      std::make_shared<const ServedModel>("toy", std::make_shared<const Model>(test::toy_model()));
  std::shared_ptr<const Pool> kept;
  std::vector<std::shared_ptr<const void>> gone;
  Clock::time_point now{std::chrono::seconds(100)};
  SubscriptionTable table{model, kept, std::uint64_t{1} << 30,
                          [this](std::shared_ptr<const void> what) { gone.push_back(std::move(what)); }};
  FakeMember first, second;
};

TEST(SubscriptionTableTest, EqualSpecsShareOneRow) {
  Seats seats;
  const std::uint32_t mesh = seats.add(seats.first, mesh_of_skin());
  EXPECT_EQ(seats.add(seats.second, mesh_of_skin()), mesh);
  const std::uint32_t slower = seats.add(seats.second, mesh_of_skin(10));
  EXPECT_NE(slower, mesh);
  EXPECT_EQ(seats.table.rows().size(), 2U);
  EXPECT_TRUE(seats.table.shows(mesh_of_skin(10).spec));
  EXPECT_FALSE(seats.table.shows(mesh_of_skin(20).spec));
  EXPECT_EQ(seats.table.requests_of(seats.first).size(), 1U);
  EXPECT_EQ(seats.table.requests_of(seats.second).size(), 2U);
  EXPECT_EQ(seats.table.requests_of(seats.second)[1].id, slower);
  EXPECT_EQ(seats.table.requests().size(), 2U);

  EXPECT_FALSE(seats.table.remove(seats.first, slower)) << "it is another's";
  EXPECT_TRUE(seats.table.remove(seats.first, mesh));
  EXPECT_FALSE(seats.table.remove(seats.first, mesh));
  EXPECT_TRUE(seats.table.find(mesh)) << "somebody sees it still";
  EXPECT_TRUE(seats.gone.empty());
  seats.table.remove(seats.second);
  EXPECT_TRUE(seats.table.rows().empty());
  EXPECT_EQ(seats.table.find(mesh), nullptr);
  EXPECT_EQ(seats.gone.size(), 2U) << "streams end elsewhere";
}

TEST(SubscriptionTableTest, ANewRowHasTheNumberThatWasAskedFor) {
  Seats seats;
  SubscriptionRequest again = mesh_of_skin();
  again.id = 41;
  EXPECT_EQ(seats.add(seats.first, again), 41U);
  again.id = 42;
  EXPECT_EQ(seats.add(seats.second, again), 41U) << "of equal specs the one that there is";
}

TEST(SubscriptionTableTest, WhatStreamsKeepIsCountedOfTheMembersShare) {
  Seats seats;
  const Model& model = seats.model->model();
  const SubscriptionRequest request = scan_request();
  const auto& whole = std::get<VolumeSpec>(request.spec);
  const std::uint64_t bytes = kept_by(model, whole, rest_voxels(model, whole));
  const auto share = std::make_shared<const Pool>(bytes, seats.kept);
  seats.first.share = share;
  const std::uint32_t volume = seats.add(seats.first, scan_request());
  EXPECT_NE(volume, 0U);
  EXPECT_EQ(share->bytes(), bytes);
  EXPECT_EQ(seats.kept->bytes(), bytes);
  SubscriptionRequest packed = scan_request();
  std::get<VolumeSpec>(packed.spec).compressed = true;
  EXPECT_EQ(seats.add(seats.first, packed), 0U) << "its share is full";
  EXPECT_NE(seats.add(seats.first, scan_request(true)), 0U) << "of planes nothing is kept";
  EXPECT_NE(seats.add(seats.second, packed), 0U);
  seats.table.remove(seats.first);
  seats.gone.clear();
  EXPECT_EQ(share->bytes(), 0U);
}

TEST(SubscriptionTableTest, KindsAreToldApart) {
  Seats seats;
  seats.add(seats.first, scan_request());
  EXPECT_TRUE(seats.table.shows(kVolumes));
  EXPECT_FALSE(seats.table.shows(kMeshes | kPlanes));
  seats.serve();
  EXPECT_FALSE(seats.table.anybody_waits());
  seats.table.wait(kPlanes, seats.now, seats.now, true);
  EXPECT_FALSE(seats.table.anybody_waits());
  seats.table.wait(kPlanes | kVolumes, seats.now, seats.now - milliseconds(5), true);
  EXPECT_EQ(seats.table.rows()[0].waiting_since, seats.now - milliseconds(5));
  seats.table.wait(kVolumes, seats.now, seats.now, true);
  EXPECT_EQ(seats.table.rows()[0].waiting_since, seats.now - milliseconds(5)) << "for longer";
}

TEST(SubscriptionTableTest, ARateHoldsFramesBackUntilTheyAreDue) {
  Seats seats;
  SubscriptionRow& row = seats.row(seats.add(seats.first, mesh_of_skin(10)));
  EXPECT_FALSE(row.held_back(seats.now));
  row.begin_frame(seats.now);
  EXPECT_FALSE(row.held_back(seats.now)) << "the first was late";
  row.begin_frame(seats.now);
  seats.now += milliseconds(99);
  EXPECT_TRUE(row.held_back(seats.now));
  ASSERT_TRUE(seats.table.next_due());
  EXPECT_EQ(*seats.table.next_due(), seats.now + milliseconds(1));
  seats.table.wait(kMeshes, seats.now, seats.now, true);
  EXPECT_FALSE(seats.table.anybody_waits());
  seats.table.wake(seats.now);
  EXPECT_FALSE(seats.table.anybody_waits());
  seats.now += milliseconds(1);
  seats.table.wake(seats.now);
  EXPECT_TRUE(seats.table.anybody_waits());
  EXPECT_FALSE(seats.table.next_due());
  EXPECT_FALSE(row.held_back(seats.now));
  // Late ones catch up, but no more than one frame's time is saved.
  seats.now += std::chrono::seconds(5);
  row.begin_frame(seats.now);
  EXPECT_FALSE(row.held_back(seats.now)) << "the frame that was late";
  for (int i = 0; i < 3; ++i) row.begin_frame(seats.now);
  EXPECT_FALSE(row.held_back(seats.now + milliseconds(100))) << "however many frames there were";
}

TEST(SubscriptionTableTest, KeyframesThatSomebodyLacksKeepTheirDistance) {
  Seats seats;
  const std::uint32_t id = seats.add(seats.first, mesh_of_skin(0, v1::ENCODING_U16_DELTA));
  SubscriptionRow& row = seats.row(id);
  EXPECT_EQ(row.take_keyframes(seats.now, false), ~0U);
  EXPECT_EQ(row.subscription.keyframes & 1, 0U) << "it is being made";
  row.begin_frame(seats.now);
  const auto made = seats.now;
  PosedFrame frame;
  frame.subscription = id;
  frame.number = 2;
  seats.first.has_keyframes = false;
  seats.table.deliver(row, frame, seats.now);
  EXPECT_EQ(seats.first.frames, std::vector<std::uint64_t>{2});
  EXPECT_TRUE(seats.table.anybody_waits()) << "for one, of the present pose";
  seats.now += milliseconds(40);
  EXPECT_EQ(row.take_keyframes(seats.now, false), 0U);
  EXPECT_EQ(row.refresh_at, made + milliseconds(100));
  EXPECT_NE(row.subscription.keyframes & 1, 0U) << "it is owed";
  row.refresh_at.reset();
  seats.table.put_off_keyframes(kVolumes, seats.now);
  EXPECT_TRUE(seats.table.anybody_waits());
  seats.table.put_off_keyframes(kMeshes, seats.now);
  EXPECT_FALSE(seats.table.anybody_waits());
  EXPECT_EQ(seats.table.next_due(), made + milliseconds(100));
  EXPECT_NE(row.take_keyframes(seats.now, true), 0U) << "where none is too soon";
  EXPECT_EQ(row.last_keyframe, seats.now);
}

TEST(SubscriptionTableTest, WhoseKeyframesComeNeedsNoOthers) {
  Seats seats;
  SubscriptionRow& row = seats.row(seats.add(seats.first, mesh_of_skin()));
  seats.add(seats.second, mesh_of_skin());
  row.take_keyframes(seats.now, false);
  seats.serve();
  PosedFrame frame;
  frame.subscription = row.subscription.id;
  seats.table.deliver(row, frame, seats.now);
  EXPECT_EQ(seats.first.frames.size() + seats.second.frames.size(), 2U);
  EXPECT_FALSE(seats.table.anybody_waits());
  seats.table.put_off_keyframes(kMeshes, seats.now);
  EXPECT_FALSE(seats.table.next_due());
}

TEST(SubscriptionTableTest, WhoWaitsIsPutOffToTheNextPose) {
  Seats seats;
  seats.add(seats.first, mesh_of_skin());
  const auto until = seats.now + milliseconds(50);
  seats.table.put_off(kVolumes, until);
  EXPECT_FALSE(seats.table.next_due());
  seats.table.put_off(kMeshes, until);
  EXPECT_EQ(seats.table.next_due(), until);
  seats.table.put_off(kMeshes, until + milliseconds(50));
  EXPECT_EQ(seats.table.next_due(), until) << "once";
  EXPECT_TRUE(seats.table.anybody_waits()) << "a pose that comes shows it";
}

}  // namespace
}  // namespace ecorche::server
