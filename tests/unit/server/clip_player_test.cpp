// SPDX-License-Identifier: Apache-2.0
// A clip as it is played, paused and steered, without a session.
#include "runtime/server/session/clip.hpp"

#include <gtest/gtest.h>

namespace ecorche::server {
namespace {

// Ten poses, one each 50 ms: half a second.
std::shared_ptr<const Clip> ten_poses() {
  auto clip = std::make_shared<Clip>();
  clip->name = "ten";
  clip->last_seconds = 0.05;
  for (int row = 0; row < 10; ++row) {
    clip->at.push_back(0.05 * row);
    clip->poses.push_back(Pose::rest(1));
    clip->poses.back().root_translation.x() = row;
  }
  return clip;
}

struct Played {
  net::io_context io;
  std::vector<int> rows;  // that were shown
  int changes = 0;
  std::function<void(int)> on_row = [](int) {};
  std::shared_ptr<ClipPlayer> player = std::make_shared<ClipPlayer>(
      io,
      [this](const Pose& pose) {
        rows.push_back(static_cast<int>(pose.root_translation.x()));
        on_row(rows.back());
      },
      [this] { ++changes; });

  ~Played() { player->release(); }
  void wait(std::chrono::milliseconds time) {
    io.restart();
    io.run_for(time);
  }
  void steer(const ClipSteering& to) const { player->steer(to); }
};

constexpr std::chrono::milliseconds kWhile{150}, kLonger{2000};

TEST(ClipPlayerTest, PlaysToTheEndAndStaysThere) {
  Played played;
  played.player->play(ten_poses(), {.speed = 5});
  EXPECT_EQ(played.rows, std::vector{0}) << "at once";
  EXPECT_TRUE(played.player->playing());
  played.wait(kLonger);
  ASSERT_FALSE(played.rows.empty());
  EXPECT_EQ(played.rows.back(), 9);
  EXPECT_TRUE(std::is_sorted(played.rows.begin(), played.rows.end()));
  EXPECT_EQ(std::adjacent_find(played.rows.begin(), played.rows.end()), played.rows.end()) << "each once";
  EXPECT_FALSE(played.player->playing());
  ASSERT_TRUE(played.player->clip());
  EXPECT_EQ(played.player->position(), 0.5);
  EXPECT_EQ(played.changes, 2) << "its begin and its end";
  // From there it begins again.
  played.steer({.paused = false, .position = {}, .step = 0, .speed = {}, .loop = {}});
  EXPECT_EQ(played.rows.back(), 0);
  EXPECT_TRUE(played.player->playing());
}

TEST(ClipPlayerTest, IsPausedWhereItIsAndGoesOnFromThere) {
  Played played;
  played.player->play(ten_poses(), {.speed = 0.5, .loop = true});
  played.wait(kWhile);
  played.steer({.paused = true, .position = {}, .step = 0, .speed = {}, .loop = {}});
  const double at = played.player->position();
  const std::size_t shown = played.rows.size();
  EXPECT_GT(at, 0.05);
  EXPECT_LT(at, 0.5);
  played.wait(kWhile);
  EXPECT_EQ(played.player->position(), at);
  EXPECT_EQ(played.rows.size(), shown);
  EXPECT_FALSE(played.player->playing());
  played.steer({.paused = false, .position = {}, .step = 0, .speed = 1, .loop = {}});
  EXPECT_NEAR(played.player->position(), at, 0.05);
  EXPECT_EQ(played.player->speed(), 1);
  EXPECT_TRUE(played.player->loops()) << "what is absent stays";
  played.wait(kWhile);
  EXPECT_GT(played.rows.size(), shown);
}

TEST(ClipPlayerTest, ShowsWhereItIsTakenTo) {
  Played played;
  played.player->play(ten_poses(), {.paused = true, .position = 0.27});
  EXPECT_EQ(played.rows, std::vector{5});
  EXPECT_FALSE(played.player->playing());
  const auto seek = [&](double to) {
    played.steer({.paused = {}, .position = to, .step = 0, .speed = {}, .loop = {}});
  };
  seek(0.1);
  EXPECT_EQ(played.rows, (std::vector{5, 2}));
  EXPECT_EQ(played.player->position(), 0.1);
  seek(0.12);
  EXPECT_EQ(played.rows.size(), 2U) << "the same pose";
  seek(0.5);
  EXPECT_EQ(played.rows.back(), 9);
  played.wait(kWhile);
  EXPECT_EQ(played.rows.size(), 3U) << "it is paused";
  seek(0);
  EXPECT_EQ(played.rows.back(), 0);
}

TEST(ClipPlayerTest, StepsByPosesAndNotPastTheEnds) {
  Played played;
  played.player->play(ten_poses(), {.loop = true, .position = 0.12});
  const auto step = [&](int by) {
    played.steer({.paused = {}, .position = {}, .step = by, .speed = {}, .loop = {}});
    return played.rows.back();
  };
  EXPECT_EQ(step(1), 3);
  EXPECT_FALSE(played.player->playing()) << "a step pauses";
  EXPECT_EQ(played.player->position(), ten_poses()->at[3]);
  EXPECT_EQ(step(-1), 2);
  EXPECT_EQ(step(5), 7);
  EXPECT_EQ(step(std::numeric_limits<int>::max()), 9);
  EXPECT_EQ(step(std::numeric_limits<int>::min()), 0);
  played.steer({.paused = {}, .position = 0.2, .step = 1, .speed = {}, .loop = {}});
  EXPECT_EQ(played.rows.back(), 5) << "from where it is taken to";
}

TEST(ClipPlayerTest, GoesRoundUntilItIsStopped) {
  Played played;
  played.player->play(ten_poses(), {.speed = 20, .loop = true});
  played.wait(kWhile);
  EXPECT_FALSE(std::is_sorted(played.rows.begin(), played.rows.end())) << "25 ms a round";
  EXPECT_LT(played.player->position(), 0.5);
  EXPECT_EQ(played.changes, 1) << "time alone changes nothing";
  played.player->stop();
  EXPECT_EQ(played.changes, 2);
  const std::size_t shown = played.rows.size();
  played.wait(kWhile);
  EXPECT_EQ(played.rows.size(), shown);
  EXPECT_FALSE(played.player->clip());
  played.player->stop();
  played.steer({.paused = false, .position = 0.1, .step = 3, .speed = {}, .loop = {}});
  EXPECT_EQ(played.changes, 2) << "there is nothing to stop or to steer";
  EXPECT_EQ(played.rows.size(), shown);
}

// Whoever is shown a pose may take control, and stop what plays.
TEST(ClipPlayerTest, MayBeStoppedByWhoIsShownAPose) {
  Played played;
  played.on_row = [&](int row) {
    if (row == 3) played.player->stop();
  };
  played.player->play(ten_poses(), {.speed = 5});
  played.wait(kLonger);
  EXPECT_EQ(played.rows.back(), 3);
}

}  // namespace
}  // namespace ecorche::server
