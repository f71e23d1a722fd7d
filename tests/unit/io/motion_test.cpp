// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

#include "io/motion/bvh.hpp"
#include "tests/unit/io/assimp_reading.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRadiansADegree = std::numbers::pi / 180;

double degrees_between(const Quaterniond& a, const Quaterniond& b) {
  return 2 * std::atan2((a.conjugate() * b).vec().norm(), std::abs((a.conjugate() * b).w())) /
         kRadiansADegree;
}

Quaterniond random_turn(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
}

Clip random_clip(std::size_t frames) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1000, 1000);
  Clip clip;
  clip.name = "walk";
  clip.frame_seconds = 1.0 / 30;
  // A branch after a branch: the file's depth-first order is not this one's order.
  clip.joints = {{"hips", -1, {0, 0, 900}},
                 {"leg_left", 0, {100, 0, -20}},
                 {"leg_right", 0, {-100, 0, -20}},
                 {"foot_left", 1, {0, 3, -800}},
                 {"foot_right", 2, {0, 3, -800}}};
  for (std::size_t f = 0; f < frames; ++f) {
    clip.root_position.emplace_back(uniform(random), uniform(random), uniform(random));
    for (std::size_t j = 0; j < clip.joints.size(); ++j) clip.rotation.push_back(random_turn(random));
  }
  // Where the middle angle of ZXY is a quarter turn, the other two are not told apart. In LPS that turn is
  // about x too.
  clip.rotation[1] = Quaterniond(AngleAxisd(90 * kRadiansADegree, Vector3d::UnitX())) *
                     Quaterniond(AngleAxisd(0.4, Vector3d::UnitY()));
  clip.rotation[2] = Quaterniond(AngleAxisd(-90 * kRadiansADegree, Vector3d::UnitX())) *
                     Quaterniond(AngleAxisd(-2, Vector3d::UnitZ()));
  return clip;
}

// A file of two joints whose second has these channels and values, beside the root's position.
std::string small_file(const std::string& order, const Vector3d& degrees) {
  std::string channels, values = "1 2 3 0 0 0";
  for (std::size_t k = 0; k < 3; ++k) {
    channels += std::string(" ") + order[k] + "rotation";
    values += " " + std::to_string(degrees[static_cast<int>(k)]);
  }
  return "HIERARCHY\nROOT hips\n{\n  OFFSET 0 0 0\n  CHANNELS 6 Xposition Yposition Zposition Zrotation "
         "Xrotation Yrotation\n"
         "  JOINT knee\n  {\n    OFFSET 4 5 6\n    CHANNELS 3" +
         channels +
         "\n    End Site\n    {\n      OFFSET 0 1 0\n    }\n  }\n}\nMOTION\nFrames: 2\nFrame Time: "
         "0.008333\n" +
         values + "\n" + values + "\n";
}

Clip parse(const std::string& text) {
  return read_whole(*open_bvh(TextStream(std::make_unique<std::istringstream>(text), "a.bvh"), "a"));
}

TEST(Bvh, WrittenAndReadIsTheSameMotion) {
  const Scratch scratch;
  const Clip clip = random_clip(50);
  write_bvh(scratch / "walk.bvh", clip);
  const Clip back = read_bvh(scratch / "walk.bvh");
  EXPECT_EQ(back.name, "walk");
  EXPECT_NEAR(back.frame_seconds, clip.frame_seconds, 1e-7);
  ASSERT_EQ(back.frames(), clip.frames());
  ASSERT_EQ(back.joints.size(), clip.joints.size());
  double worst_turn = 0, worst_mm = 0;
  for (std::size_t j = 0; j < clip.joints.size(); ++j) {
    std::size_t same = 0;
    while (same < back.joints.size() && back.joints[same].name != clip.joints[j].name) ++same;
    ASSERT_LT(same, back.joints.size());
    worst_mm = std::max(worst_mm, (back.joints[same].offset - clip.joints[j].offset).norm());
    for (std::size_t f = 0; f < clip.frames(); ++f) {
      worst_turn =
          std::max(worst_turn, degrees_between(back.rotation[f * 5 + same], clip.rotation[f * 5 + j]));
    }
  }
  for (std::size_t f = 0; f < clip.frames(); ++f) {
    worst_mm = std::max(worst_mm, (back.root_position[f] - clip.root_position[f]).norm());
  }
  EXPECT_LT(worst_turn, 1e-4);
  EXPECT_LT(worst_mm, 1e-4);
  std::printf("round trip: %.2e degrees, %.2e mm\n", worst_turn, worst_mm);
}

// By hand: in the file x is left, y up, z forward; in LPS left is x, up is z, forward is -y.
TEST(Bvh, TheFrameIsTurnedToLps) {
  const Scratch scratch;
  const Clip clip = read_bvh(scratch.put("a.bvh", small_file("ZXY", {0, 0, 90})), 10);
  EXPECT_TRUE(clip.root_position[1].isApprox(Vector3d(10, -30, 20)));
  EXPECT_TRUE(clip.joints[1].offset.isApprox(Vector3d(40, -60, 50)));
  EXPECT_EQ(clip.joints[1].parent, 0);
  EXPECT_NEAR(clip.frame_seconds, 0.008333, 1e-12);
  // A quarter turn about up takes forward (z of the file) to left (x of the file).
  EXPECT_TRUE((clip.rotation[1] * Vector3d(0, -1, 0)).isApprox(Vector3d(1, 0, 0), 1e-12));
}

// The product of three turns in the order of the channels, written out by hand as matrices in the file's
// frame.
Eigen::Matrix3d turn(char axis, double degrees) {
  const double c = std::cos(degrees * kRadiansADegree), s = std::sin(degrees * kRadiansADegree);
  Eigen::Matrix3d m;
  if (axis == 'X') m << 1, 0, 0, 0, c, -s, 0, s, c;
  if (axis == 'Y') m << c, 0, s, 0, 1, 0, -s, 0, c;
  if (axis == 'Z') m << c, -s, 0, s, c, 0, 0, 0, 1;
  return m;
}

TEST(Bvh, EveryRotationOrder) {
  const Scratch scratch;
  Eigen::Matrix3d to_lps;
  to_lps << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Vector3d angles(25, -130, 70);
  for (const std::string order : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"}) {
    const auto path = scratch.put(order + ".bvh", small_file(order, angles));
    const Eigen::Matrix3d file =
        turn(order[0], angles[0]) * turn(order[1], angles[1]) * turn(order[2], angles[2]);
    const Clip clip = read_bvh(path);
    EXPECT_LT(
        (clip.rotation[3].toRotationMatrix() - to_lps * file * to_lps.transpose()).cwiseAbs().maxCoeff(),
        1e-12)
        << order;
    const auto opinion = foreign::assimp_motion(path);
    EXPECT_LT(degrees_between(opinion.rotation.at("knee").at(1), Quaterniond(file)), 1e-3) << order;
    EXPECT_TRUE(opinion.position.at("hips").at(1).isApprox(Vector3d(1, 2, 3)));
  }
}

TEST(Bvh, EveryPrefixIsRefused) {
  const std::string whole = small_file("XYZ", {10, 20, 30.25});
  // The last digits may go: 30.250000 is 30.2, 30. and 3 as well.
  const std::size_t shortest = whole.rfind(' ') + 2;
  for (std::size_t n = 0; n < shortest; ++n) {
    EXPECT_THROW(parse(whole.substr(0, n)), Error) << n;
  }
}

TEST(Bvh, FlippedBytesNeverHarm) {
  const std::string whole = small_file("XYZ", {10, 20, 30});
  std::mt19937 random(2);
  int read = 0;
  for (int round = 0; round < 1500; ++round) {
    std::string bytes = whole;
    for (int flips = 0; flips < 1 + round % 3; ++flips)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    try {
      const Clip clip = parse(bytes);
      ASSERT_EQ(clip.rotation.size(), clip.frames() * clip.joints.size());
      for (const Quaterniond& q : clip.rotation) ASSERT_NEAR(q.norm(), 1, 1e-9);
      ++read;
    } catch (const Error& error) {
      ASSERT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::data));
    }
  }
  EXPECT_GT(read, 20);
}

TEST(Bvh, EveryMistakeIsNamed) {
  const Scratch scratch;
  const std::string good = small_file("XYZ", {10, 20, 30});
  const auto refused = [&](std::string from, const std::string& to, const std::string& part) {
    std::string text = good;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, text.npos);
    text.replace(at, from.size(), to);
    const auto path = scratch.put("leg.bvh", text);
    expect_error(ErrorKind::data, part, [&] { read_bvh(path); });
  };
  refused("HIERARCHY", "{}", "leg.bvh:1: expected 'HIERARCHY', found '{}'");
  refused("JOINT knee", "JOINT hips",
          "leg.bvh:6: the joint 'hips' stands twice (give each joint its own name)");
  refused("Zrotation\n    End", "Xrotation\n    End", "leg.bvh:9: a channel of 'knee' stands twice");
  refused("Zrotation\n    End", "Wrotation\n    End",
          "expected a channel such as Xrotation, found 'Wrotation'");
  refused("Frames: 2", "Frames: 3", "expected a number, the file ends");
  refused("Frames: 2", "Frames: 1", "expected the file's end after the last frame, found '1'");
  refused("Frames: 2", "Frames: 0", "leg.bvh:17: has no frame");
  refused("Frames: 2", "Frames: 1000000", "says 1000000 frames, more than the file can hold");
  refused("0.008333", "-1", "leg.bvh:18: its frame time is not positive");
  refused("1 2 3", "1 nan 3", "leg.bvh:19: the number nan is not finite");
  refused("CHANNELS 3", "CHANNELS 7", "expected a number up to 6, found '7'");
  refused("OFFSET 4 5 6", "OFFSET 4 5 1e999", "the number 1e999 is not finite");
  expect_error(ErrorKind::missing_input, "none.bvh", [&] { read_bvh(scratch / "none.bvh"); });
  expect_error(ErrorKind::usage, "is no unit of length", [&] { read_bvh(scratch / "none.bvh", 0); });
  refused("OFFSET 4 5 6", "OFFSET 4 5 " + std::string(5000, '6'),
          "leg.bvh:8: a word has more than 4096 letters");
  std::string wide = "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 0\n";
  for (int i = 0; i < 5000; ++i) wide += "JOINT j" + std::to_string(i) + "\n{\nOFFSET 0 0 0\nCHANNELS 0\n}\n";
  expect_error(ErrorKind::data, "more than 4096 joints", [&] { read_bvh(scratch.put("wide.bvh", wide)); });
  std::string deep = "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 0\n";
  for (int i = 0; i < 100000; ++i) deep += "JOINT j" + std::to_string(i) + "\n{\nOFFSET 0 0 0\nCHANNELS 0\n";
  expect_error(ErrorKind::data, "joints nested deeper than 256",
               [&] { read_bvh(scratch.put("deep.bvh", deep)); });
}

TEST(Bvh, AClipThatDoesNotFitIsNotWritten) {
  const Scratch scratch;
  Clip clip = random_clip(2);
  clip.rotation.pop_back();
  expect_error(ErrorKind::internal, "a.bvh: the clip's joints and frames do not fit together (report this)",
               [&] { write_bvh(scratch / "a.bvh", clip); });
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

}  // namespace
}  // namespace ecorche::io
