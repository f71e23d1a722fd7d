// SPDX-License-Identifier: Apache-2.0
// Who is in a session and what others call them, and how often they are told, without a session.
#include "runtime/server/session/presence.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "runtime/server/handlers/display_name.hpp"
#include "runtime/server/session/change_notifier.hpp"
#include "tests/unit/server/fake_member.hpp"

namespace ecorche::server {
namespace {

struct Room {
  Clock::time_point now{std::chrono::seconds(100)};
  Control control{std::chrono::seconds(10), now};
  Presence presence;
  int changes = 0;
  FakeMember first, second, third;

  Room() {
    control.on_change([this] {
      presence.follow(control);
      ++changes;
    });
    first.connection = 11;
    first.called = "Ada";
    first.features = {v1::FEATURE_PRESENCE};
    second.connection = 12;
    second.called = "Bo";
    third.connection = 13;
    for (Member* member : {&first, &second, &third}) control.join(*member, false, now);
  }
  std::string listed() const {
    std::string out;
    const v1::Members list = presence.list(control);
    for (const v1::SessionMember& member : list.members()) {
      out += std::to_string(member.connection()) + member.name() +
             (member.role() == v1::ROLE_CONTROLLER ? "!" : "") + (member.asks_control() ? "?" : "") +
             (member.takes_control() ? "+" : "") + " ";
    }
    return out;
  }
};

TEST(PresenceTest, ListsWhoHoldsControlThenWhoAsksThenTheOthersAsTheyCame) {
  Room room;
  EXPECT_EQ(room.listed(), "11Ada!+ 12Bo 13 ");
  EXPECT_EQ(room.presence.list(room.control).others(), 0U);
  EXPECT_TRUE(room.presence.ask(room.third, true));
  EXPECT_FALSE(room.presence.ask(room.third, true)) << "it does already";
  EXPECT_EQ(room.listed(), "11Ada!+ 13? 12Bo ");
  EXPECT_TRUE(room.presence.ask(room.third, false));
  EXPECT_FALSE(room.presence.ask(room.third, false));
  EXPECT_EQ(room.listed(), "11Ada!+ 12Bo 13 ");
  EXPECT_EQ(find_member(room.control, 12), &room.second);
  EXPECT_EQ(find_member(room.control, 14), nullptr);
}

TEST(PresenceTest, WhoLeavesOrHasItAsksNoMore) {
  Room room;
  room.presence.ask(room.second, true);
  room.presence.ask(room.third, true);
  room.changes = 0;
  EXPECT_FALSE(room.control.transfer(room.second, room.third, room.now)) << "it is not its to give";
  EXPECT_EQ(room.changes, 0);
  EXPECT_TRUE(room.control.transfer(room.first, room.third, room.now));
  EXPECT_EQ(room.changes, 1);
  EXPECT_EQ(room.listed(), "13! 12Bo? 11Ada+ ");
  EXPECT_EQ(room.third.control.back(), (FakeMember::ControlNews{v1::ROLE_CONTROLLER, false, 0}));
  EXPECT_EQ(room.first.control.back(), (FakeMember::ControlNews{v1::ROLE_OBSERVER, false, 0}));
  room.control.leave(room.second, true, room.now);
  EXPECT_FALSE(room.presence.asks(room.second));
  EXPECT_EQ(room.listed(), "13! 11Ada+ ");
  // Control that becomes free is a change, too.
  room.changes = 0;
  room.control.leave(room.third, true, room.now);
  EXPECT_EQ(room.listed(), "11Ada+ ");
  room.now += std::chrono::seconds(11);
  room.control.expire(room.now);
  room.control.claim(room.first, room.now);
  room.control.release(room.first, room.now);
  EXPECT_EQ(room.changes, 3);
}

TEST(PresenceTest, NoMoreThanSixtyFourAreListed) {
  Room room;
  std::vector<std::unique_ptr<FakeMember>> crowd;
  for (int i = 0; i < 80; ++i) {
    crowd.push_back(std::make_unique<FakeMember>());
    crowd.back()->connection = 100 + static_cast<std::uint64_t>(i);
    room.control.join(*crowd.back(), false, room.now);
  }
  room.presence.ask(*crowd.back(), true);
  const v1::Members members = room.presence.list(room.control);
  EXPECT_EQ(members.members_size(), 64);
  EXPECT_EQ(members.others(), 19U);
  EXPECT_EQ(members.members(1).connection(), 179U) << "who asks is among them";
}

TEST(DisplayName, IsPlainAndShort) {
  EXPECT_EQ(display_name("  Dr. Müller  "), "Dr. Müller");
  EXPECT_EQ(display_name("a\nb\tc\x7f"), "abc");
  EXPECT_EQ(display_name("Ada\u202egnp.exe"), "Adagnp.exe") << "nothing turns its neighbours round";
  EXPECT_EQ(display_name("A\u200bd\u2066a\ufeff\u2028"), "Ada");
  EXPECT_EQ(display_name("\u200b \u2060"), "");
  EXPECT_EQ(display_name("\U000E0041x"), "x");
  EXPECT_EQ(display_name("bad \xff\xc0\xafutf\xe2\x82"), "bad utf");
  EXPECT_EQ(display_name(std::string(1000, 'x')), std::string(64, 'x'));
  std::string umlauts;
  for (int i = 0; i < 70; ++i) umlauts += "ü";
  EXPECT_EQ(display_name(umlauts).size(), 128U) << "characters, not bytes";
}

TEST(NewsTest, TellsSoonOnceAndNotTooOften) {
  net::io_context io;
  std::vector<Clock::time_point> told;
  ChangeNotifier news(io, std::chrono::milliseconds(100), [&] { told.push_back(Clock::now()); });
  const auto wait = [&](int ms) {
    const auto until = Clock::now() + std::chrono::milliseconds(ms);
    io.restart();
    io.run_until(until);  // or until there is nothing to wait for
    std::this_thread::sleep_until(until);
  };
  const auto begin = Clock::now();
  for (int i = 0; i < 5; ++i) news.changed();
  EXPECT_TRUE(told.empty()) << "not within the change";
  wait(20);
  ASSERT_EQ(told.size(), 1U);
  for (int i = 0; i < 5; ++i) news.changed();
  wait(300);
  ASSERT_EQ(told.size(), 2U) << "one for all";
  EXPECT_GE(told[1] - begin, std::chrono::milliseconds(100));
  news.schedule_after(std::chrono::milliseconds(150));
  news.changed();  // comes before
  wait(60);
  EXPECT_EQ(told.size(), 3U);
  wait(400);
  EXPECT_EQ(told.size(), 3U);
  news.schedule_after(std::chrono::milliseconds(120));
  news.cancel();
  wait(300);
  EXPECT_EQ(told.size(), 3U);
}

}  // namespace
}  // namespace ecorche::server
