// SPDX-License-Identifier: Apache-2.0
// Clips of glTF: by hand, and written by ourselves for others.
#include <gtest/gtest.h>

#include "io/motion/gltf_clip.hpp"
#include "io/surface/rigged_glb.hpp"
#include "tests/unit/io/assimp_reading.hpp"
#include "tests/unit/io/clip_samples.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

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
    SCOPED_TRACE(part);
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
  refused("\"path\":\"rotation\"", "\"path\":\"weights\"", "its animation turns nothing");
  refused("\"name\":\"hip\",", "\"name\":\"hip\",\"scale\":[1,1,0],", "a joint's transform is flat");
  refused("\"children\":[1]},", "\"children\":[1,2]},", "its nodes are no tree");
  std::string apart = gltf();  // the hip and the knee beside it, both moving
  for (const std::string part : {",\"children\":[1]", ",\"children\":[2]"})
    apart.erase(apart.find(part), part.size());
  apart.replace(apart.find("{\"nodes\":[0]}"), 13, "{\"nodes\":[1,2]}");
  expect_error(ErrorKind::data, "its joints have two roots (export one skeleton, its joints under one root)",
               [&] { parse_gltf_clip(apart, "a.gltf"); });
  refused("\"scenes\":[{\"nodes\":[0]}]", "\"scenes\":[{\"nodes\":[]}]", "no node of its scene is moved");
  const auto timed = [](const std::vector<float>& times, float way = 1) {
    std::string text = gltf();
    const std::size_t at = text.find("base64,") + 7;
    const auto h = static_cast<float>(std::numbers::sqrt2 / 2);
    std::vector<float> buffer = times;
    for (const float x :
         {0.F, way, 0.F, 0.F, 1.F, 1.F, 0.F, 1.F, 2.F, 0.F, 0.F, h, h, h, 0.F, 0.F, h, 0.F, 0.F, 0.F, 1.F})
      buffer.push_back(x);
    return text.replace(at, text.find('"', at) - at, base64(buffer));
  };
  expect_error(ErrorKind::data, "the times of an animation are not ascending", [&] {
    parse_gltf_clip(timed({0, 1, 0.5F}), "a.gltf");
  });
  // The knee at 5 kHz, the hip for ten days: its times are the beginning of its ways.
  std::string endless = timed({0, 2e-4F, 4e-4F}, 9e5F);
  endless.replace(endless.find("\"input\":0,\"output\":1"), 20, "\"input\":3,\"output\":4");
  endless.insert(endless.find("],\"bufferViews\""),
                 R"(,{"bufferView":1,"componentType":5126,"count":2,"type":"SCALAR"})"
                 R"(,{"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"})");
  expect_error(ErrorKind::data, "its animation is too long", [&] { parse_gltf_clip(endless, "a.gltf"); });
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
  SkinnedSurface skin{"skin", Group::skin, {Points(3, 3), Triangles(1, 3)}, {}};
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
  clip.rotation.pop_back();
  expect_error(ErrorKind::internal, "c.glb: the clip's joints and frames do not fit together (report this)",
               [&] { write_rigged_glb(scratch / "c.glb", clip, {skin}); });
  clip.rotation.push_back(clip.rotation.back());
  skin.influences.joint[0][0] = 7;
  expect_error(ErrorKind::internal, "no four joints a vertex",
               [&] { write_rigged_glb(scratch / "b.glb", clip, {skin}); });
  EXPECT_FALSE(std::filesystem::exists(scratch / "b.glb"));
}

}  // namespace
}  // namespace ecorche::io
