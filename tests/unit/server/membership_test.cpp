// SPDX-License-Identifier: Apache-2.0
// Who is in a session and has control, without a session.
#include "runtime/server/session/control.hpp"

#include <gtest/gtest.h>

#include "tests/unit/server/fake_member.hpp"

namespace ecorche::server {
namespace {

using News = FakeMember::ControlNews;
constexpr auto kController = v1::ROLE_CONTROLLER;
constexpr auto kObserver = v1::ROLE_OBSERVER;

struct Members {
  Clock::time_point now{std::chrono::seconds(100)};
  Control control{std::chrono::seconds(10), now};
  FakeMember first, second, third;

  v1::Role join(Member& member, bool heir = false) { return control.join(member, heir, now); }
  void leave(Member& member, bool may_return) { control.leave(member, may_return, now); }
};

TEST(ControlTest, IsTheFirstMembersUntilItReleasesIt) {
  Members m;
  EXPECT_FALSE(m.control.taken(m.now));
  EXPECT_EQ(m.join(m.first), kController);
  EXPECT_EQ(m.join(m.second), kObserver);
  EXPECT_TRUE(m.control.controls(m.first));
  EXPECT_TRUE(m.control.claim(m.first, m.now)) << "it has it already";
  EXPECT_FALSE(m.control.claim(m.second, m.now));
  EXPECT_FALSE(m.control.release(m.second, m.now));
  EXPECT_TRUE(m.first.control.empty() && m.second.control.empty()) << "nothing has changed";
  m.now += std::chrono::seconds(1);
  EXPECT_TRUE(m.control.release(m.first, m.now));
  EXPECT_EQ(m.control.controller(), nullptr);
  EXPECT_EQ(m.control.uncontrolled_since(), m.now);
  EXPECT_FALSE(m.control.taken(m.now));
  const News vacant{kObserver, true, 0};
  EXPECT_EQ(m.first.control, std::vector{vacant});
  EXPECT_EQ(m.second.control, std::vector{vacant});
  EXPECT_TRUE(m.control.claim(m.second, m.now));
  EXPECT_EQ(m.first.control.back(), (News{kObserver, false, 0}));
  EXPECT_EQ(m.second.control.back(), (News{kController, false, 0}));
}

// Who joins hears of its own role by the answer, the others at once.
TEST(ControlTest, IsGivenToWhoJoinsWhereItIsFree) {
  Members m;
  m.join(m.first);
  m.control.release(m.first, m.now);
  m.first.control.clear();
  EXPECT_EQ(m.join(m.second), kController);
  EXPECT_EQ(m.first.control, (std::vector<News>{{kObserver, false, 0}}));
  EXPECT_TRUE(m.second.control.empty());
}

TEST(ControlTest, IsReservedForWhoMayComeBack) {
  Members m;
  m.join(m.first);
  m.join(m.second);
  m.leave(m.first, true);
  EXPECT_EQ(m.second.control, (std::vector<News>{{kObserver, false, 10}}));
  m.now += std::chrono::seconds(9);
  EXPECT_TRUE(m.control.taken(m.now));
  EXPECT_FALSE(m.control.claim(m.second, m.now));
  EXPECT_EQ(m.join(m.third, true), kObserver) << "an heir of another session";
  EXPECT_EQ(m.control.rejoin(m.first, true, m.now), kController);
  EXPECT_EQ(m.second.control.back(), (News{kObserver, false, 0}));
  // Not for ever.
  m.leave(m.first, true);
  m.now += std::chrono::seconds(9);
  m.control.expire(m.now);
  EXPECT_FALSE(m.second.control.back().vacant);
  m.now += std::chrono::seconds(1);
  m.control.expire(m.now);
  EXPECT_TRUE(m.second.control.back().vacant);
  const std::size_t told = m.second.control.size();
  m.control.expire(m.now);
  EXPECT_EQ(m.second.control.size(), told) << "once";
  EXPECT_TRUE(m.control.claim(m.second, m.now));
  EXPECT_EQ(m.control.rejoin(m.first, true, m.now), kObserver) << "somebody has it";
}

TEST(ControlTest, IsFreeAtOnceWhereNobodyComesBack) {
  Members m;
  m.join(m.first);
  m.join(m.second);
  m.leave(m.first, false);
  EXPECT_EQ(m.second.control, (std::vector<News>{{kObserver, true, 0}}));
  EXPECT_TRUE(m.control.claim(m.second, m.now));
  m.second.control.clear();
  m.join(m.third);
  m.leave(m.third, false);
  EXPECT_TRUE(m.second.control.empty()) << "who left had nothing";
}

TEST(ControlTest, AwaitsAnHeirOfTheSessionBefore) {
  Members m;
  m.control.await_heir(m.now);
  EXPECT_TRUE(m.control.taken(m.now));
  EXPECT_EQ(m.join(m.first), kObserver);
  EXPECT_EQ(m.join(m.second, true), kController);
  EXPECT_EQ(m.join(m.third, true), kObserver);
}

TEST(ControlTest, KnowsSinceWhenNobodyIsThere) {
  Members m;
  EXPECT_EQ(m.control.empty_since(), m.now);
  EXPECT_FALSE(m.control.awaits_return());
  m.join(m.first);
  m.join(m.second);
  EXPECT_EQ(m.control.members().size(), 2U);
  EXPECT_FALSE(m.control.empty_since());
  m.leave(m.first, false);
  m.now += std::chrono::seconds(5);
  m.leave(m.second, true);
  EXPECT_EQ(m.control.empty_since(), m.now);
  EXPECT_TRUE(m.control.awaits_return());
}

}  // namespace
}  // namespace ecorche::server
