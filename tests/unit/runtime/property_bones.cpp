// SPDX-License-Identifier: Apache-2.0
// Bones stay bones over a walk: they move rigidly, and no soft tissue ends inside one.
#include <tbb/parallel_for.h>

#include <atomic>
#include <cstdio>

#include <ecorche/io/pose_library.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include "runtime/quality/bone_tets.hpp"
#include "tests/unit/runtime/bone_depth.hpp"
#include "tests/unit/runtime/prepared_body.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;
constexpr double kDeep = 0.5;  // mm

std::span<const float> floats(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

Vector3d vertex(std::span<const float> points, std::size_t v) {
  return {static_cast<double>(points[3 * v]), static_cast<double>(points[3 * v + 1]),
          static_cast<double>(points[3 * v + 2])};
}

TEST(Bones, MoveRigidlyOverTheWalk) {
  for (const std::string& path : test::model_paths()) {
    const auto model = test::read_model(path);
    const BodyPoser poser(model);
    PosedBody body = poser.make_frame();
    std::vector<std::uint32_t> bones;
    for (std::uint32_t t = 0; t < model->tissues.size(); ++t) {
      if (model->tissues[t].segment != Tissue::by_tets) bones.push_back(t);
    }
    double worst = 0;
    const auto poses = test::walk(*model);
    for (const Pose& pose : poses) {
      ASSERT_TRUE(poser.run(pose, Skinning::cor, bones, body).ok());
      for (const std::uint32_t t : bones) {
        worst = std::max(worst, rigid_residual(floats(model->tissues[t].V), body.tissues[t]));
      }
    }
    std::printf("%s: %zu bones over %zu frames, worst residual of the best rigid fit %.2e mm\n",
                test::short_name(path).c_str(), bones.size(), poses.size(), worst);
    EXPECT_LE(worst, 1e-3);
  }
}

TEST(Bones, TetsMoveRigidlyInEveryLibraryPoseAndOverTheWalk) {
  for (const std::string& path : test::model_paths()) {
    const auto model = test::read_model(path);
    EXPECT_GT(model->certificate.bone_tets, 1000U);
    EXPECT_LE(model->certificate.bone_tet_change, 1e-9);
    std::vector<Pose> poses = test::walk(*model, 10);
    for (const std::string& name : io::library_poses())
      poses.push_back(io::library_pose(name, model->rig).pose);
    const BodyPoser poser(model);
    PosedBody body = poser.make_frame();
    BoneTets worst;
    for (const Pose& pose : poses) {
      for (const Skinning skinning : test::all_skinnings) {
        ASSERT_TRUE(poser.run(pose, skinning, {}, body).ok());
        const BoneTets tets = measure_bone_tets(*model, body.nodes);
        worst.count = tets.count;
        worst.inverted += tets.inverted;
        worst.changed += tets.changed;
        worst.largest_change_mm = std::max(worst.largest_change_mm, tets.largest_change_mm);
      }
    }
    std::printf(
        "%s: %llu tets of bones, %zu contested, in %zu poses %llu inverted, %llu changed, by at most %.2e "
        "mm\n",
        test::short_name(path).c_str(), static_cast<unsigned long long>(worst.count), model->contested.size(),
        poses.size(), static_cast<unsigned long long>(worst.inverted),
        static_cast<unsigned long long>(worst.changed), worst.largest_change_mm);
    EXPECT_EQ(worst.inverted, 0U) << path;
    EXPECT_EQ(worst.changed, 0U) << path;
  }
}

struct Bone {
  std::size_t segment;
  std::string name;
  test::BoneDepth depth;
};

std::vector<Bone> bones_of(const Model& model) {
  std::vector<Bone> bones;
  for (const Tissue& tissue : model.tissues) {
    if (tissue.segment == Tissue::by_tets) continue;
    bones.push_back({static_cast<std::size_t>(tissue.segment), tissue.name, test::BoneDepth(tissue)});
  }
  return bones;
}

// What one tissue did: per vertex the greatest depth over the clip, -1 where it was in a bone at rest.
struct Depths {
  std::vector<double> deepest;
  std::vector<std::int32_t> bone;

  std::size_t followed() const {
    return static_cast<std::size_t>(
        std::count_if(deepest.begin(), deepest.end(), [](double d) { return d >= 0; }));
  }
  std::size_t deep() const {
    return static_cast<std::size_t>(
        std::count_if(deepest.begin(), deepest.end(), [](double d) { return d > kDeep; }));
  }
};

Depths start(const Tissue& tissue, const std::vector<Bone>& bones) {
  const auto count = static_cast<std::size_t>(tissue.V.rows());
  Depths out{std::vector<double>(count, 0), std::vector<std::int32_t>(count, -1)};
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t v) {
    for (const Bone& bone : bones) {
      if (bone.depth.inside(vertex(floats(tissue.V), v))) out.deepest[v] = -1;
    }
  });
  return out;
}

void follow(const PosedBody& body, std::size_t row, const std::vector<Bone>& bones, Depths& depths) {
  std::vector<RigidTransform> back;
  for (const Bone& bone : bones) back.push_back(body.segments[bone.segment].inverse());
  tbb::parallel_for(std::size_t{0}, depths.deepest.size(), [&](std::size_t v) {
    if (depths.deepest[v] < 0) return;
    for (std::size_t b = 0; b < bones.size(); ++b) {
      const double depth = bones[b].depth.depth(back[b] * vertex(body.tissues[row], v));
      if (depth <= depths.deepest[v]) continue;
      depths.deepest[v] = depth;
      depths.bone[v] = static_cast<std::int32_t>(b);
    }
  });
}

std::size_t count_deep(const Model& model, const BodyPoser& poser, Skinning skinning,
                       const std::vector<Pose>& poses, const std::vector<Bone>& bones) {
  std::vector<std::uint32_t> soft;
  std::vector<Depths> depths;
  for (std::uint32_t t = 0; t < model.tissues.size(); ++t) {
    if (model.tissues[t].segment != Tissue::by_tets) continue;
    soft.push_back(t);
    depths.push_back(start(model.tissues[t], bones));
  }
  PosedBody body = poser.make_frame();
  for (const Pose& pose : poses) {
    EXPECT_TRUE(poser.run(pose, skinning, soft, body).ok());
    for (std::size_t i = 0; i < soft.size(); ++i) follow(body, soft[i], bones, depths[i]);
  }
  std::size_t followed = 0, deep = 0;
  for (std::size_t i = 0; i < soft.size(); ++i) {
    followed += depths[i].followed();
    deep += depths[i].deep();
    if (depths[i].deep() == 0) continue;
    const auto worst =
        std::max_element(depths[i].deepest.begin(), depths[i].deepest.end()) - depths[i].deepest.begin();
    const auto v = static_cast<std::size_t>(worst);
    const Vector3d at = vertex(floats(model.tissues[soft[i]].V), v);
    std::printf("    %-24s %6zu of %7zu, worst %.2f mm in %s at rest (%.1f, %.1f, %.1f)\n",
                model.tissues[soft[i]].name.c_str(), depths[i].deep(), depths[i].followed(),
                depths[i].deepest[v], bones[static_cast<std::size_t>(depths[i].bone[v])].name.c_str(), at.x(),
                at.y(), at.z());
  }
  std::printf(
      "  %s: %zu of %zu vertices outside all bones at rest end deeper than %.1f mm in one over %zu frames\n",
      std::string(skinning_name(skinning)).c_str(), deep, followed, kDeep, poses.size());
  return deep;
}

TEST(Bones, NoTissueEndsInsideOneOverTheWalk) {
  for (const std::string& path : test::model_paths()) {
    const auto model = test::read_model(path);
    const BodyPoser poser(model);
    const std::vector<Bone> bones = bones_of(*model);
    std::size_t vertices = 0;
    for (const Tissue& tissue : model->tissues) vertices += static_cast<std::size_t>(tissue.V.rows());
    const auto poses = test::walk(*model, test::frame_step(vertices, 12'000'000));
    std::printf("%s\n", test::short_name(path).c_str());
    for (const Skinning skinning : {Skinning::lbs, Skinning::dqs, Skinning::cor}) {
      EXPECT_EQ(count_deep(*model, poser, skinning, poses, bones), 0u) << path;
    }
  }
}

}  // namespace
}  // namespace ecorche::runtime
