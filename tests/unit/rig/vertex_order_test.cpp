// SPDX-License-Identifier: Apache-2.0
// Joints go by where a body's surfaces lie: not by its hand, and not by how a file lists the vertices.
#include "preprocess/rig/vertex_order.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <numeric>
#include <random>

#include "preprocess/rig/bone_points.hpp"
#include "tests/unit/rig/human_bodies.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

SurfaceMesh listed_otherwise(const SurfaceMesh& mesh, std::mt19937_64& random) {
  std::vector<std::int32_t> place(static_cast<std::size_t>(mesh.V.rows()));
  std::iota(place.begin(), place.end(), 0);
  std::shuffle(place.begin(), place.end(), random);
  SurfaceMesh out = mesh;
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v)
    out.V.row(place[static_cast<std::size_t>(v)]) = mesh.V.row(v);
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    for (int i = 0; i < 3; ++i) out.F(f, i) = place[static_cast<std::size_t>(mesh.F(f, i))];
  }
  return out;
}

/// The phantom's bones, rough by up to 1.5 mm, so that no two of its sides are alike and its fits have many
/// answers.
const std::vector<CaseBone>& rough_body() {
  static const std::vector<CaseBone> made = [] {
    std::vector<CaseBone> bones =
        test::phantom_bones({"pelvis", "lumbar", "thorax", "neck", "head", "girdle_left", "upper_arm_left",
                             "forearm_left", "hand_left", "thigh_left", "shank_left", "foot_left"},
                            6);
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> off(-1.5, 1.5);
    for (CaseBone& bone : bones)
      bone.surface.V = bone.surface.V.unaryExpr([&](double at) { return at + off(random); });
    return bones;
  }();
  return made;
}

double turned_by_deg(const Matrix3d& turn) {
  return Eigen::AngleAxisd(turn).angle() * 180 / std::numbers::pi;
}

// Joints of `now` where those of the rough body are, after `mirror` (1, or -1 along x).
void expect_the_same(const test::Found& now, double mirror) {
  static const test::Found before = test::found(rough_body());
  const Vector3d image(mirror, 1, 1);
  for (const Segment& segment : before.rig.skeleton.segments) {
    const std::string& name = segment.joint.name;
    const std::string twin = other_side(name);
    const std::string& there = mirror < 0 && !twin.empty() ? twin : name;
    const Joint& joint = now.joint(there);
    // A joint's x points to the left on both sides, in a mirrored body, too.
    const Matrix3d axes = image.asDiagonal() * segment.joint.axes * image.asDiagonal();
    EXPECT_LT((joint.center - image.cwiseProduct(segment.joint.center)).norm(), 0.1) << there;
    EXPECT_LT(turned_by_deg(joint.axes.transpose() * axes), 0.1) << there;
    EXPECT_NEAR(now.confidence(there), before.confidence(name), 0.001) << there;
  }
}

TEST(VertexOrder, joints_do_not_depend_on_how_vertices_are_listed) {
  std::vector<CaseBone> bones = rough_body();
  std::mt19937_64 random(7);
  for (CaseBone& bone : bones) bone.surface = listed_otherwise(bone.surface, random);
  std::reverse(bones.begin(), bones.end());
  expect_the_same(test::found(bones), 1);
}

TEST(VertexOrder, a_mirrored_body_listed_otherwise_has_mirrored_joints) {
  std::vector<CaseBone> bones = rough_body();
  std::mt19937_64 random(11);
  for (CaseBone& bone : bones) {
    bone.surface = listed_otherwise(test::mirrored(bone.surface), random);
    const std::string other = other_side(bone.segment);
    if (!other.empty()) bone.segment = other;
  }
  expect_the_same(test::found(bones), -1);
}

TEST(VertexOrder, both_sides_of_a_symmetric_body_are_alike) {
  std::vector<CaseBone> bones = rough_body();
  std::erase_if(bones, [](const CaseBone& bone) { return bone.segment.ends_with("_right"); });
  std::mt19937_64 random(13);
  for (std::size_t b = 0, count = bones.size(); b < count; ++b) {
    CaseBone twin = bones[b];
    twin.surface = listed_otherwise(test::mirrored(twin.surface), random);
    twin.name += "_mirrored";
    if (const std::string other = other_side(twin.segment); !other.empty()) twin.segment = other;
    bones.push_back(twin);
  }
  const test::Found now = test::found(bones);
  const Vector3d image(-1, 1, 1);
  for (const Segment& segment : now.rig.skeleton.segments) {
    if (!segment.joint.name.ends_with("_left")) continue;
    const Joint& right = now.joint(other_side(segment.joint.name));
    EXPECT_LT((right.center - image.cwiseProduct(segment.joint.center)).norm(), 0.1) << right.name;
    const Matrix3d axes = image.asDiagonal() * segment.joint.axes * image.asDiagonal();
    EXPECT_LT(turned_by_deg(right.axes.transpose() * axes), 0.1) << right.name;
  }
}

TEST(VertexOrder, a_surface_stays_the_same_and_its_mirror_image_is_listed_alike) {
  const SurfaceMesh& femur = rough_body()[0].surface;
  const SurfaceMesh left = by_place(femur, "thigh_left");
  std::mt19937_64 random(17);
  const SurfaceMesh right = by_place(listed_otherwise(test::mirrored(femur), random), "thigh_right");
  ASSERT_EQ(left.V.rows(), femur.V.rows());
  EXPECT_TRUE(left.V.col(0).isApprox(-right.V.col(0)));
  EXPECT_TRUE(left.V.rightCols(2).isApprox(right.V.rightCols(2)));
  for (Eigen::Index f = 0; f < femur.F.rows(); ++f) {
    for (int i = 0; i < 3; ++i) EXPECT_EQ(left.V.row(left.F(f, i)), femur.V.row(femur.F(f, i)));
  }
}

TEST(VertexOrder, a_box_of_a_whole_bone_holds_every_vertex_of_it_however_it_lies) {
  Case patient;
  patient.bones = {rough_body()[0]};
  Region all;
  all.name = "all";
  all.segment = patient.bones[0].segment;
  all.of_bones = true;
  all.boxes.emplace_back(Vector3d(0.3, 0, 0), Vector3d(1, 1, 1));
  all.boxes.emplace_back(Vector3d(0, 0, 0), Vector3d(0.6, 1, 1));
  patient.regions = {all};
  RegionUse use;
  use.region = "all";
  for (int turn = 0; turn < 40; ++turn) {
    patient.bones[0].surface.V *= Eigen::AngleAxisd(0.3, Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    BonePoints points(patient);
    EXPECT_EQ(points.of(use).at.rows(), patient.bones[0].surface.V.rows()) << turn;
  }
}

}  // namespace
}  // namespace ecorche::rig
