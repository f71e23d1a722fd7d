// SPDX-License-Identifier: Apache-2.0
// A bone that was cut along its length has the other's length, and is no whole one for that.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "preprocess/rig/joint_sources.hpp"
#include "tests/unit/rig/human_bodies.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Vector3d;

// Pelvis, thighs and shanks; the right femur's outer half is not there, and the left one is rough by `mm`.
std::vector<CaseBone> halved(double mm) {
  std::vector<CaseBone> bones = test::phantom_bones({"pelvis", "thigh_left", "shank_left"}, 4);
  for (CaseBone& bone : bones) {
    Points& V = bone.surface.V;
    if (bone.segment == "thigh_right") {
      const double middle = V.col(0).mean();
      bone.surface = test::part_of(bone.surface, [&](const Vector3d& p) { return p.x() > middle; });
    } else if (bone.segment == "thigh_left") {
      for (Eigen::Index v = 0; v < V.rows(); ++v)
        V.row(v) += mm * Eigen::RowVector3d(std::sin(37.0 * static_cast<double>(v)),
                                            std::sin(53.0 * static_cast<double>(v)),
                                            std::sin(71.0 * static_cast<double>(v)));
    }
  }
  return bones;
}

const SurfaceMesh& surface(const std::vector<CaseBone>& bones, const std::string& segment) {
  return std::find_if(bones.begin(), bones.end(), [&](const CaseBone& b) { return b.segment == segment; })
      ->surface;
}

TEST(HalvedBone, covers_half_of_the_other) {
  const std::vector<CaseBone> bones = halved(0);
  const SurfaceMesh &left = surface(bones, "thigh_left"), &half = surface(bones, "thigh_right");
  const auto whole = laid_onto(left, test::mirrored(left)), part = laid_onto(left, half);
  ASSERT_TRUE(whole && part);
  EXPECT_GT(whole->covered, 0.95);
  EXPECT_GT(part->share, 0.9) << "it is as long";
  EXPECT_LT(part->covered, 0.75);
  SurfaceMesh points = half;
  points.F.resize(0, 3);
  EXPECT_FALSE(laid_onto(left, points)) << "without triangles nothing lies on it";
}

TEST(HalvedBone, gives_the_other_side_nothing_and_is_not_sure_beside_it) {
  std::vector<CaseBone> bones = halved(3);
  for (CaseBone& bone : bones) {
    if (bone.segment != "thigh_right") continue;
    Points& V = bone.surface.V;
    const double low = V.col(2).minCoeff(), middle = V.col(0).mean();
    for (Eigen::Index v = 0; v < V.rows(); ++v) {
      if (V(v, 2) < low + 60) V(v, 1) += 0.45 * (V(v, 0) - middle);  // condyles of no other knee
    }
  }
  const test::Found now = test::found(bones);
  EXPECT_EQ(now.joint("knee_left").rule, CenterRule::cylinder_fit) << "not taken from half a bone";
  EXPECT_EQ(now.joint("knee_right").rule, CenterRule::cylinder_fit);
  EXPECT_LT(now.confidence("knee_left"), JointSources::least_confidence);
  EXPECT_LT(now.confidence("knee_right"), JointSources::least_confidence);
  EXPECT_LT(now.confidence("hip_right"), JointSources::least_confidence) << "its frame rests on the knee";
  EXPECT_TRUE(now.said("knee_right", "off the mirror image of knee_left, which is not sure"));
  EXPECT_TRUE(now.said("knee_right", "with confidence 45 % at most"));
}

}  // namespace
}  // namespace ecorche::rig
