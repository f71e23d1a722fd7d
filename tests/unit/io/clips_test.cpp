// SPDX-License-Identifier: Apache-2.0
// Motion files other than BVH, and what all have in common: frames from the disk, hostile bytes.
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "io/motion/amc.hpp"
#include "io/motion/bvh.hpp"
#include "io/motion/gltf_clip.hpp"
#include "io/motion/table_file.hpp"
#include "tests/unit/io/clip_samples.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

Clip amc(const std::string& frames, const std::string& skeleton = kAsf) {
  return read_whole(*open_amc(stream(frames, "a.amc"), stream(skeleton, "a.asf"), "a"));
}

// By matrices, as Lander writes it: L = C M C^-1, each a product about fixed axes, x first.
TEST(Amc, TurnsAreThoseOfTheFormat) {
  const Clip clip = amc(kAmc);
  ASSERT_EQ(clip.joints.size(), 3U);
  EXPECT_EQ(clip.joints[1].name, "thigh");
  EXPECT_EQ(clip.joints[2].parent, 1);
  const double unit = 25.4 / 0.45;
  EXPECT_LT((clip.joints[2].offset - unit * 7.5 * lsa_to_lps() * Vector3d(0.34202, -0.939693, 0)).norm(),
            1e-3);
  EXPECT_LT((clip.root_position[0] - unit * Vector3d(1, -3, 2)).norm(), 1e-9);
  const auto expect = [&](std::size_t joint, const Matrix3d& file) {
    const Matrix3d turned = lsa_to_lps() * file * lsa_to_lps().transpose();
    EXPECT_LT((clip.rotation[joint].toRotationMatrix() - turned).cwiseAbs().maxCoeff(), 1e-12) << joint;
  };
  expect(0, about(2, 30) * about(1, 20) * about(0, 10));
  const Matrix3d c = about(2, 30) * about(1, 20) * about(0, 10);
  expect(1, c * about(2, 60) * about(1, 50) * about(0, 40) * c.transpose());
  const Matrix3d d = about(2, 20);
  expect(2, d * about(0, 70) * d.transpose());
  for (std::size_t j = 3; j < 6; ++j) EXPECT_EQ(clip.rotation[j].w(), 1) << "frame 2, bones in another order";
}

TEST(Amc, EveryMistakeIsNamed) {
  const auto refused = [](const std::string& from, const std::string& to, const std::string& part,
                          bool skeleton) {
    std::string a = kAmc, s = kAsf;
    std::string& text = skeleton ? s : a;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, text.npos) << from;
    text.replace(at, from.size(), to);
    expect_error(ErrorKind::data, part, [&] { amc(a, s); });
  };
  refused("shank 70\n", "", "a.amc:7: expected a bone of the skeleton, found '2'", false);
  refused("shank 70", "shank 70 80", "frame 80 stands where 2 should", false);
  refused("shank 70", "thigh 1 2 3", "the bone 'thigh' stands twice in one frame", false);
  refused("shank 70", "foot 70", "expected a bone of the skeleton, found 'foot'", false);
  refused("shank 70", "shank nan", "is not finite", false);
  refused("\n2\n", "\n3\n", "frame 3 stands where 2 should", false);
  refused("1\nroot 1 2 3 10 20 30\nthigh 40 50 60\nshank 70\n2\nroot 1 2 3 0 0 0\nshank 0\nthigh 0 0 0\n", "",
          "has no frame", false);
  refused("thigh shank", "thigh hand", "the bone 'hand' is not in :bonedata", true);
  refused("root thigh", "root thigh shank", "the bone 'shank' has two parents", true);
  refused("root thigh\n    thigh shank", "shank thigh\n    thigh shank",
          "has children before it has a parent", true);
  refused("name shank", "name thigh", "the bone 'thigh' stands twice", true);
  refused("orientation 0 0 0", "orientation 0 90 0", "its root is turned at rest", true);
  refused("length 0.45", "length 0", "its unit of length is not positive", true);
  refused("dof rx ry rz", "dof rx rx rz", "stands twice", true);
  refused("axis 0 0 20 XYZ", "axis 0 0 20 XYY", "expected an order of axes", true);
  refused("direction 0 -2 0", "direction 0 0 0", "has a length and no direction", true);
  refused(":hierarchy", ":skin", "has no :hierarchy", true);
  refused(":DEGREES", ":RADIANS", "a.amc:3: its angles are in radians, its skeleton's in degrees", false);
  refused(":name VICON", ":nome VICON", "expected a section such as :bonedata, found ':nome'", true);
  refused("position 0 0 0", "posture 0 0 0", "expected order, axis, position or orientation, found 'posture'",
          true);
  refused("angle deg", "angle grad", "expected deg or rad, found 'grad'", true);
  refused("order TX TY TZ RX RY RZ", "order TX TY TZ RX RY QZ",
          "expected a degree of freedom such as rx, found 'QZ'", true);
  refused(":bonedata", ":root\n:bonedata", "a.asf:15: has two roots", true);
  refused("    name thigh\n", "", "a bone has no name", true);
  refused(":units", ":documentation", "has no :units before its :hierarchy", true);
  refused("thigh shank\n  end\n", "thigh shank\n", "expected end, ", true);
  const std::string stiff = "    dof rx\n    limits (-10.0 170.0)\n";
  std::string skeleton = kAsf, frames = kAmc;
  skeleton.erase(skeleton.find(stiff), stiff.size());
  frames.replace(frames.find("thigh 40"), 5, "shank");
  expect_error(ErrorKind::data, "the bone 'shank' has no degree of freedom in its skeleton",
               [&] { amc(frames, skeleton); });
}

TEST(Amc, TheSkeletonBesideIsFound) {
  const Scratch scratch;
  const auto clip = scratch.put("02_01.amc", kAmc);
  expect_error(ErrorKind::missing_input,
               "its skeleton is not beside it: 0 .asf files are (name it by --asf FILE)",
               [&] { open_clip(clip); });
  scratch.put("other.asf", kAsf);
  EXPECT_EQ(asf_of(clip).filename(), "other.asf");
  scratch.put("02.asf", kAsf);
  EXPECT_EQ(asf_of(clip).filename(), "02.asf");
  EXPECT_EQ(open_clip(clip)->frames(), 2U);
  expect_error(ErrorKind::usage, "'.fbx' is no ending of a motion file",
               [&] { open_clip(scratch / "a.fbx"); });
}

TEST(OpenSim, ColumnsByName) {
  AngleFile file(stream(kMot, "a.mot"));
  EXPECT_EQ(file.columns(), (std::vector<std::string>{"knee_angle_r", "pelvis_tx"}));
  EXPECT_TRUE(file.in_degrees());
  ASSERT_EQ(file.frames(), 3U);
  EXPECT_NEAR(file.frame_seconds(), 0.01, 1e-12);
  EXPECT_EQ(file.read(2)[0], 30);
  EXPECT_EQ(file.read(0)[1], 0.1);
}

TEST(OpenSim, EveryMistakeIsNamed) {
  const auto refused = [](const std::string& from, const std::string& to, const std::string& part) {
    std::string text = kMot;
    text.replace(text.find(from), from.size(), to);
    expect_error(ErrorKind::data, part, [&] { AngleFile file(stream(text, "a.mot")); });
  };
  refused("endheader", "", "no 'endheader'");
  refused("nRows=3", "nRows=4", "says 4 rows and has 3");
  refused("nColumns=3", "nColumns=4", "says 4 columns and names 3");
  refused("time knee", "knee", "its first column is not 'time'");
  refused("pelvis_tx\n", "knee_angle_r\n", "the column 'knee_angle_r' stands twice");
  refused("0.3\n", "\n", "expected a number, the file ends");
  refused("0.02", "-1", "its times do not ascend");
  refused("30", "inf", "is not finite");
  refused("inDegrees=yes", "inDegrees=maybe", "expected yes or no");
  refused("nRows=3", "nRows=2.5", "a.mot:4: expected a count, found '2.5'");
  std::string many = " ";
  for (int i = 0; i < 5000; ++i) many += "a" + std::to_string(i) + " ";
  refused(" pelvis_tx", many, "a.mot:8: more than 4096 columns");
  refused("walk", std::string((1 << 20) + 1, 'w'), "a.mot:1: a line has more than 1 MiB");
}

TEST(Trc, MarkersAndThoseNotSeen) {
  MarkerFile file(stream(kTrc, "a.trc"));
  EXPECT_EQ(file.markers(), (std::vector<std::string>{"knee", "ankle"}));
  ASSERT_EQ(file.frames(), 2U);
  EXPECT_NEAR(file.frame_seconds(), 0.01, 1e-12);
  EXPECT_LT((file.read(0)[0] - Vector3d(100, -300, 200)).norm(), 1e-9);
  EXPECT_TRUE(std::isnan(file.read(1)[0].x()));
  EXPECT_LT((file.read(1)[1] - Vector3d(4000, -6000, 5000)).norm(), 1e-9);
}

TEST(Trc, EveryMistakeIsNamed) {
  const auto refused = [](const std::string& from, const std::string& to, const std::string& part) {
    std::string text = kTrc;
    text.replace(text.find(from), from.size(), to);
    expect_error(ErrorKind::data, part, [&] { MarkerFile file(stream(text, "a.trc")); });
  };
  refused("PathFileType", "Path", "expected 'PathFileType'");
  refused("\t2\t2\tm", "\t3\t2\tm", "says 3 frames and has 2");
  refused("\t2\t2\tm", "\t2\t5\tm", "says 5 markers and names 2");
  refused("\tm\t", "\tfurlong\t", "expected the unit mm, cm or m");
  refused("\tankle", "\tknee", "the marker 'knee' stands twice");
  refused("4\t5\t6", "4\t5\t6\t7", "a frame has 9 fields for 2 markers");
  refused("4\t5\t6", "4\tx\t6", "expected a number, found 'x'");
  refused("DataRate\t", "", "a.trc:4: its header has other values than names");
  refused("\n100\t", "\n-1\t", "a.trc:4: its data rate is not positive");
  refused("Frame#\tTime", "Time\tFrame#", "is no TRC: no row of 'Frame#', 'Time' and markers");
}

// The twin: all frames in memory; against any order of reading from the disk.
TEST(Streaming, AnyOrderGivesTheSameFrames) {
  const Scratch scratch;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> degrees(-170, 170);
  Clip clip;
  clip.joints = {{"a", -1, {0, 0, 1}}, {"b", 0, {0, 0, 300}}};
  for (int f = 0; f < 1000; ++f) {
    clip.root_position.emplace_back(f, degrees(random), 1);
    for (int j = 0; j < 2; ++j)
      clip.rotation.emplace_back(AngleAxisd(degrees(random) * kDegree, Vector3d::Unit(j)));
  }
  write_bvh(scratch / "long.bvh", clip);
  const auto file = open_clip(scratch / "long.bvh");
  const Clip whole = read_whole(*open_clip(scratch / "long.bvh"));
  ASSERT_EQ(file->frames(), 1000U);
  std::vector<Quaterniond> turn(2);
  Vector3d whole_root;
  for (int i = 0; i < 500; ++i) {
    const std::size_t f = random() % 1000;
    Vector3d root;
    file->read(f, root, turn);
    ASSERT_EQ(root, whole.root_position[f]);
    for (std::size_t j = 0; j < 2; ++j) ASSERT_EQ(turn[j].coeffs(), whole.rotation[2 * f + j].coeffs());
  }
  // Cut while it plays.
  file->read(0, whole_root, turn);
  std::filesystem::resize_file(scratch / "long.bvh", std::filesystem::file_size(scratch / "long.bvh") / 2);
  Vector3d root;
  EXPECT_THROW(file->read(999, root, turn), Error);
  std::string table = "walk\nversion=1\nnRows=4000\nnColumns=2\ninDegrees=yes\nendheader\ntime a\n";
  for (int f = 0; f < 4000; ++f) table += std::to_string(f) + " 1" + std::string(60, ' ') + "\n";
  AngleFile angles(TextStream::open(scratch.put("long.mot", table)));
  angles.read(0);
  std::filesystem::resize_file(scratch / "long.mot", table.size() / 2);
  expect_error(ErrorKind::io,
               "long.mot: has fewer frames than when it was opened (leave the file as it is while it plays)",
               [&] { angles.read(3999); });
}

// The kernel lets this file be opened and refuses to read it, as a bad disk does.
TEST(Streaming, ADiskThatFailsIsNamed) {
  const Scratch scratch;
  std::filesystem::create_symlink("/proc/self/mem", scratch / "a.bvh");
  expect_error(ErrorKind::io, "a.bvh: reading failed half way (check the disk)",
               [&] { open_clip(scratch / "a.bvh"); });
  expect_error(ErrorKind::missing_input, "cannot be opened (check the path and its permissions)",
               [&] { TextStream::open(scratch / "none.bvh"); });
}

TEST(Streaming, AllOfALongClipAtOnceIsRefused) {
  struct Long final : ClipFile {
    Long() {
      head_.joints.resize(30);
      frames_ = std::size_t{1} << 40;
    }
    void read(std::size_t, Vector3d&, std::span<Quaterniond>) override {}
  } clip;
  expect_error(ErrorKind::data, "are too many at once", [&] { read_whole(clip); });
}

// Bytes of any format, cut or changed, are read or refused, and nothing else; what is read is finite.
TEST(Hostile, EveryFormat) {
  const auto clip = [](ClipFile& file) {
    for (const Quaterniond& q : read_whole(file).rotation) ASSERT_NEAR(q.norm(), 1, 1e-6);
  };
  const std::vector<std::pair<std::string, std::function<void(const std::string&)>>> formats{
      {kAmc, [&](const std::string& text) { clip(*open_amc(stream(text, "a"), stream(kAsf, "b"), "c")); }},
      {kAsf, [&](const std::string& text) { clip(*open_amc(stream(kAmc, "a"), stream(text, "b"), "c")); }},
      {gltf(), [&](const std::string& text) { clip(*parse_gltf_clip(text, "a.gltf")); }},
      {kMot,
       [](const std::string& text) {
         AngleFile file(stream(text, "a"));
         for (std::size_t f = 0; f < file.frames(); ++f) {
           for (const double x : file.read(f)) ASSERT_TRUE(std::isfinite(x));
         }
       }},
      {kTrc, [](const std::string& text) {
         MarkerFile file(stream(text, "a"));
         for (std::size_t f = 0; f < file.frames(); ++f)
           ASSERT_EQ(file.read(f).size(), file.markers().size());
       }}};
  std::mt19937 random(11);
  for (std::size_t k = 0; k < formats.size(); ++k) {
    const auto& [whole, read] = formats[k];
    int passed = 0;
    for (int round = 0; round < 1500; ++round) {
      std::string bytes = whole;
      if (round % 5 == 0) bytes.resize(random() % bytes.size());
      if (round % 5 == 1) bytes.insert(random() % bytes.size(), bytes.substr(random() % bytes.size(), 20));
      for (int flips = 0; flips < round % 4 && !bytes.empty(); ++flips)
        bytes[random() % bytes.size()] = static_cast<char>(random());
      try {
        read(bytes);
        ++passed;
      } catch (const Error& error) {
        ASSERT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::data))
            << k << ": " << error.what();
      }
      if (HasFatalFailure()) return;
    }
    EXPECT_GT(passed, 20) << k;
  }
}

}  // namespace
}  // namespace ecorche::io
