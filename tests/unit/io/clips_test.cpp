// SPDX-License-Identifier: Apache-2.0
// Motion files other than BVH, and what all have in common: frames from the disk, hostile bytes.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <sstream>

#include "io/motion/amc.hpp"
#include "io/motion/bvh.hpp"
#include "io/motion/gltf_clip.hpp"
#include "io/motion/table_file.hpp"
#include "io/surface/rigged_glb.hpp"
#include "tests/unit/io/assimp_reading.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

TextStream stream(const std::string& text, const std::string& name) {
  return {std::make_unique<std::istringstream>(text), name};
}

Matrix3d about(int axis, double degrees) {
  return AngleAxisd(degrees * kDegree, Vector3d::Unit(axis)).toRotationMatrix();
}

Matrix3d lsa_to_lps() {
  Matrix3d m;
  m << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return m;
}

const std::string kAsf = R"(# a leg
:version 1.10
:name VICON
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
  anything at all
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name thigh
    direction 0.34202 -0.939693 0
    length 7.5
    axis 10 20 30 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
    id 2
    name shank
    direction 0 -2 0
    length 7
    axis 0 0 20 XYZ
    dof rx
    limits (-10.0 170.0)
  end
:hierarchy
  begin
    root thigh
    thigh shank
  end
)";
const std::string kAmc =
    "#!OML:ASF x\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 10 20 30\nthigh 40 50 60\nshank 70\n"
    "2\nroot 1 2 3 0 0 0\nshank 0\nthigh 0 0 0\n";

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

std::string base64(const std::vector<float>& values) {
  constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
  const std::size_t size = 4 * values.size();
  std::string out;
  for (std::size_t i = 0; i < size; i += 3) {
    unsigned word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < size ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += i + k > size ? '=' : letters[word >> (18 - 6 * k) & 63];
  }
  return out;
}

// A still node, a hip below it that moves and turns, a knee that turns; both with axes of their own at rest.
// Keys at 0, 0.5, 1 s: the knee by a quarter turn about its own x from key to key.
std::string gltf(const std::string& interpolation = "LINEAR") {
  const auto h = static_cast<float>(std::numbers::sqrt2 / 2);
  const std::vector<float> buffer{0, 0.5F, 1,                              // times
                                  0, 1,    0, 0, 1, 1, 0, 1, 2,            // ways of the hip
                                  0, 0,    h, h, h, 0, 0, h, 0, 0, 0, 1};  // turns of the knee
  const auto view = [](int begin, int size) {
    return "{\"buffer\":0,\"byteOffset\":" + std::to_string(4 * begin) +
           ",\"byteLength\":" + std::to_string(4 * size) + "}";
  };
  const auto accessor = [](int number, const char* type, int count) {
    return "{\"bufferView\":" + std::to_string(number) +
           ",\"componentType\":5126,\"count\":" + std::to_string(count) + ",\"type\":\"" + type + "\"}";
  };
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[
    {"name":"scene","translation":[5,0,0],"children":[1]},
    {"name":"hip","translation":[0,1,0],"rotation":[0,0.7071067811865476,0,0.7071067811865476],"children":[2]},
    {"name":"knee","translation":[0,-0.4,0.1],"rotation":[0,0,0.7071067811865476,0.7071067811865476]}],
    "animations":[{"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}},
    {"sampler":1,"target":{"node":2,"path":"rotation"}}],
    "samplers":[{"input":0,"output":1},{"input":0,"output":2,"interpolation":")" +
         interpolation + R"("}]}],"accessors":[)" + accessor(0, "SCALAR", 3) + "," + accessor(1, "VEC3", 3) +
         "," + accessor(2, "VEC4", 3) + R"(],"bufferViews":[)" + view(0, 3) + "," + view(3, 9) + "," +
         view(12, 12) + R"(],"buffers":[{"byteLength":96,"uri":"data:application/octet-stream;base64,)" +
         base64(buffer) + "\"}]}";
}

// Where a child of the knee at (0, -0.5, 0) of its own axes is, from the file's transforms, in LPS mm.
TEST(Gltf, JointsGoWhereTheNodesGo) {
  const auto file = parse_gltf_clip(gltf(), "a.gltf");
  ASSERT_EQ(file->frames(), 3U);
  EXPECT_NEAR(file->head().frame_seconds, 0.5, 1e-6);
  const Clip clip = read_whole(*file);
  ASSERT_EQ(clip.joints.size(), 2U) << "the still node above is the scene's";
  EXPECT_EQ(clip.joints[0].name, "hip");
  using Eigen::Affine3d;
  const double h = std::numbers::sqrt2 / 2;
  const Quaterniond turns[3] = {{h, 0, 0, h}, {h, h, 0, 0}, {1, 0, 0, 0}};
  const auto knee = [&](const Vector3d& way, const Quaterniond& turn) {
    return Affine3d(Eigen::Translation3d(5, 0, 0) * Eigen::Translation3d(way) * Quaterniond(h, 0, h, 0) *
                    Eigen::Translation3d(0, -0.4, 0.1) * turn);
  };
  const Affine3d rest = knee({0, 1, 0}, turns[0]);
  const Vector3d tip = rest * Vector3d(0, -0.5, 0);
  for (std::size_t f = 0; f < 3; ++f) {
    const Affine3d now = knee({0, 1, static_cast<double>(f)}, turns[f]);
    const Vector3d at = 1000 * lsa_to_lps() * (now * Vector3d(0, -0.5, 0));
    const Quaterniond hip = clip.rotation[2 * f], both = hip * clip.rotation[2 * f + 1];
    const Vector3d drawn = clip.root_position[f] + hip * clip.joints[1].offset +
                           both * Vector3d(1000 * lsa_to_lps() * (tip - rest.translation()));
    EXPECT_LT((drawn - at).norm(), 1e-3) << f;
  }
}

TEST(Gltf, BetweenKeysTheFilesInterpolationCounts) {
  // Uneven keys become frames 1/30 s apart.
  std::string uneven = gltf();
  const std::size_t at = uneven.find("base64,") + 7;
  const auto h = static_cast<float>(std::numbers::sqrt2 / 2);
  uneven.replace(at, uneven.find('"', at) - at,
                 base64({0, 0.9F, 1, 0, 1, 0, 0, 1, 1, 0, 1, 2, 0, 0, h, h, h, 0, 0, h, 0, 0, 0, 1}));
  const auto file = parse_gltf_clip(uneven, "a.gltf");
  ASSERT_EQ(file->frames(), 31U);
  Clip clip = read_whole(*file);
  // Way: straight; turn: at an even pace from key to key.
  EXPECT_NEAR(clip.root_position[9].y(), -1000 * (9.0 / 30) / 0.9, 1e-3);
  const double whole = clip.rotation[1].angularDistance(clip.rotation[2 * 27 + 1]);
  EXPECT_NEAR(clip.rotation[1].angularDistance(clip.rotation[2 * 9 + 1]), whole / 3, 1e-6);
  const std::size_t linear = uneven.find("LINEAR");
  uneven.replace(linear, 6, "STEP");
  clip = read_whole(*parse_gltf_clip(uneven, "a.gltf"));
  EXPECT_NEAR(clip.rotation[1].angularDistance(clip.rotation[2 * 9 + 1]), 0, 1e-9);
}

TEST(Gltf, EveryMistakeIsNamed) {
  const auto refused = [](const std::string& from, const std::string& to, const std::string& part) {
    std::string text = gltf();
    const std::size_t at = text.find(from);
    ASSERT_NE(at, text.npos) << from;
    text.replace(at, from.size(), to);
    expect_error(ErrorKind::data, part, [&] { parse_gltf_clip(text, "a.gltf"); });
  };
  refused("\"animations\"", "\"extras\"", "has no animation");
  refused("\"node\":2,", "\"node\":7,", "names a node or a sampler that is not there");
  refused("\"knee\"", "\"hip\"", "the joint 'hip' stands twice");
  refused("LINEAR", "WOBBLY", "is interpolated by 'WOBBLY'");
  refused("LINEAR", "CUBICSPLINE", "3 times and");
  refused("\"children\":[2]", "\"children\":[0]", "its nodes are no tree");
  refused("\"input\":0,\"output\":1", "\"input\":9,\"output\":1", "names accessor 9");
  refused("\"input\":0,\"output\":2", "\"input\":1,\"output\":2", "has not 1 values a row");
}

// A body of two joints and one triangle, written and read by assimp and by ourselves.
TEST(RiggedGlb, OthersReadTheSame) {
  const Scratch scratch;
  Clip clip;
  clip.name = "walk";
  clip.frame_seconds = 0.25;
  clip.joints = {{"hips", -1, {10, 20, 900}}, {"knee", 0, {0, -30, -400}}};
  for (int f = 0; f < 3; ++f) {
    clip.root_position.emplace_back(10, 20 - 100.0 * f, 900);
    clip.rotation.emplace_back(AngleAxisd(0.4 * f, Vector3d(1, 2, 3).normalized()));
    clip.rotation.emplace_back(AngleAxisd(-2.5 * f, Vector3d::UnitX()));  // more than half a turn in all
  }
  SkinnedSurface skin{"skin", {Points(3, 3), Triangles(1, 3)}, {}};
  skin.mesh.V << 0, 0, 0, 100, 0, 0, 0, 0, 100;
  skin.mesh.F << 0, 1, 2;
  skin.influences.joint.assign(3, {1, 0, 0, 0});
  skin.influences.weight.assign(3, {0.75F, 0.25F, 0, 0});
  write_rigged_glb(scratch / "a.glb", clip, {skin});

  const auto other = foreign::assimp_motion(scratch / "a.glb");
  const Clip back = read_whole(*open_clip(scratch / "a.glb"));
  ASSERT_EQ(back.frames(), 3U);
  EXPECT_NEAR(back.frame_seconds, 0.25, 1e-6);
  for (std::size_t f = 0; f < 3; ++f) {
    EXPECT_LT((back.root_position[f] - clip.root_position[f]).norm(), 1e-3);
    const Vector3d p = other.position.at("hips").at(f);
    EXPECT_LT((1000 * lsa_to_lps() * p - clip.root_position[f]).norm(), 1e-3);
    for (std::size_t j = 0; j < 2; ++j) {
      EXPECT_LT(back.rotation[2 * f + j].angularDistance(clip.rotation[2 * f + j]), 1e-5);
      const Quaterniond q = other.rotation.at(clip.joints[j].name).at(f);
      const Quaterniond lps(q.w(), q.x(), -q.z(), q.y());
      EXPECT_LT(lps.angularDistance(clip.rotation[2 * f + j]), 1e-5);
    }
  }
  EXPECT_LT((back.joints[1].offset - clip.joints[1].offset).norm(), 1e-3);
  skin.influences.joint[0][0] = 7;
  expect_error(ErrorKind::internal, "no four joints a vertex",
               [&] { write_rigged_glb(scratch / "b.glb", clip, {skin}); });
  EXPECT_FALSE(std::filesystem::exists(scratch / "b.glb"));
}

const std::string kMot =
    "walk\nversion=1\nnRows=3\nnColumns=3\ninDegrees=yes\nendheader\ntime knee_angle_r pelvis_tx\n"
    "0 10 0.1\n0.01 20 0.2\n0.02\t30\t0.3\n";

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
}

const std::string kTrc =
    "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\t"
    "OrigDataStartFrame\tOrigNumFrames\n100\t100\t2\t2\tm\t100\t1\t2\nFrame#\tTime\tknee\t\t\tankle\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n1\t0\t0.1\t0.2\t0.3\t1\t2\t3\n2\t0.01\t\t\t\t4\t5\t6\n";

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
