// SPDX-License-Identifier: Apache-2.0
// The pose that waits, and when a job may begin, without a session.
#include "runtime/server/session/pose_slot.hpp"

#include <gtest/gtest.h>

#include "runtime/server/session/job_pacer.hpp"

namespace ecorche::server {
namespace {

using std::chrono::milliseconds;

PoseRequest slot_pose(std::uint64_t sequence, double x = 0) {
  PoseRequest request;
  request.sequence = sequence;
  request.pose = Pose::rest(2);
  request.pose.root_translation.x() = x;
  return request;
}

// Of a busy stretch of a session.
struct Slot {
  Clock::time_point now{std::chrono::seconds(100)};
  PoseSlot poses{Pose::rest(2)};
  void put(std::uint64_t sequence, double x = 0, bool busy = false) {
    poses.put(slot_pose(sequence, x), now, busy);
  }
  std::uint64_t make() {
    poses.begin(now);
    const PoseRequest made = poses.take();
    poses.show(made);
    poses.end(now);
    return made.sequence;
  }
};

TEST(PoseSlotTest, TheNewestPoseWinsAndTheOthersAreListed) {
  Slot slot;
  EXPECT_FALSE(slot.poses.waiting());
  EXPECT_EQ(slot.poses.present().sequence, 0U);
  for (std::uint64_t pose = 1; pose <= 300; ++pose) slot.put(pose);
  EXPECT_EQ(slot.poses.last_sequence(), 300U);
  EXPECT_EQ(slot.make(), 300U);
  EXPECT_FALSE(slot.poses.waiting());
  EXPECT_EQ(slot.poses.present().sequence, 300U);
  const Skipped skipped = slot.poses.take_skipped();
  EXPECT_EQ(skipped.count, 299U);
  ASSERT_EQ(skipped.newest.size(), Skipped::most_listed);
  EXPECT_EQ(skipped.newest.front(), 44U);
  EXPECT_EQ(skipped.newest.back(), 299U);
  EXPECT_EQ(slot.poses.take_skipped().count, 0U) << "once";
}

TEST(PoseSlotTest, ARestBeginsWithTheLastPoseOrTheEndOfItsJob) {
  Slot slot;
  slot.put(1);
  EXPECT_TRUE(slot.poses.after_rest()) << "the first of all";
  slot.put(2);
  EXPECT_TRUE(slot.poses.after_rest()) << "in place of it";
  slot.now += milliseconds(200);  // the job takes so long
  slot.make();
  slot.now += milliseconds(100);
  slot.put(3);
  EXPECT_FALSE(slot.poses.after_rest());
  slot.make();
  slot.now += milliseconds(151);
  EXPECT_TRUE(slot.poses.rests(slot.now, false));
  EXPECT_FALSE(slot.poses.rests(slot.now, true));
  slot.put(4, 0, true);
  EXPECT_FALSE(slot.poses.after_rest()) << "one is being made";
}

TEST(PoseSlotTest, ABodyThatIsPosedAsItIsStandsStill) {
  Slot slot;
  EXPECT_TRUE(slot.poses.still(slot.now));
  slot.put(1, 5);
  slot.make();
  EXPECT_FALSE(slot.poses.still(slot.now));
  for (std::uint64_t pose = 2; pose <= 5; ++pose) {
    slot.now += milliseconds(50);
    slot.put(pose, 5);
    slot.make();
  }
  EXPECT_TRUE(slot.poses.still(slot.now));
}

TEST(PoseSlotTest, WithinAStreamTheNextPoseIsExpected) {
  Slot slot;
  EXPECT_FALSE(slot.poses.next_expected(slot.now));
  slot.put(1);
  slot.make();
  const auto begun = slot.now;
  slot.now += milliseconds(49);
  EXPECT_EQ(slot.poses.next_expected(slot.now), begun + PoseSlot::next_within);
  slot.now += milliseconds(1);
  EXPECT_FALSE(slot.poses.next_expected(slot.now));
}

TEST(JobPacerTest, KeepsItsRateAndResumesWhatItPutOff) {
  net::io_context io;
  int resumed = 0;
  JobPacer pacer(io, 50, [&] { ++resumed; });
  const auto now = Clock::now();
  EXPECT_TRUE(pacer.may_begin(now));
  pacer.pace(now);
  pacer.begin();
  EXPECT_TRUE(pacer.busy());
  pacer.end();
  EXPECT_FALSE(pacer.busy());
  EXPECT_FALSE(pacer.may_begin(now + milliseconds(19)));
  EXPECT_FALSE(pacer.may_begin(now + milliseconds(19)));
  io.run();
  EXPECT_EQ(resumed, 1) << "once, however often it was asked";
  EXPECT_GE(Clock::now() - now, milliseconds(20));
  EXPECT_TRUE(pacer.may_begin(Clock::now()));
  pacer.put_off(now + std::chrono::hours(1));
  EXPECT_FALSE(pacer.may_begin(Clock::now()));
}

TEST(AlarmTest, RingsAtTheLastTimeThatWasSetAndNeverOnceItIsGone) {
  net::io_context io;
  int rung = 0;
  const auto now = Clock::now();
  {
    Alarm alarm(io, [&] { ++rung; });
    alarm.set(now + std::chrono::hours(1));
    alarm.set(now + milliseconds(5));
    io.run();
    EXPECT_EQ(rung, 1);
    alarm.set(now);
    alarm.set(std::nullopt);
    io.restart();
    io.run();
    EXPECT_EQ(rung, 1);
    alarm.set(now);  // due, and gone before it rings
  }
  io.restart();
  io.run();
  EXPECT_EQ(rung, 1);
}

}  // namespace
}  // namespace ecorche::server
