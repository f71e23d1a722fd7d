// SPDX-License-Identifier: Apache-2.0
// The human template on the phantom's legs, cut, tilted and unlike: what a bone does not show is not made up.
#include <gtest/gtest.h>

#include <numbers>

#include "phantom/bones.hpp"
#include "preprocess/rig/body_scale.hpp"
#include "preprocess/rig/joint_sources.hpp"
#include "preprocess/rig/other_side.hpp"
#include "tests/unit/rig/human_bodies.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Vector3d;
using test::Found;
using test::found;
using test::mirrored;

/// Pelvis, thighs, shanks and feet of both sides.
const std::vector<CaseBone>& legs() {
  static const std::vector<CaseBone> made =
      test::phantom_bones({"pelvis", "thigh_left", "shank_left", "foot_left"}, 4);
  return made;
}

const Found& whole() {
  static const Found made = found(legs());
  return made;
}

// The bones, those of one segment without what `keep` refuses.
template <class Keep>
std::vector<CaseBone> cut(const std::string& segment, Keep&& keep) {
  std::vector<CaseBone> bones = legs();
  for (CaseBone& bone : bones) {
    if (bone.segment == segment) bone.surface = test::part_of(bone.surface, keep);
  }
  return bones;
}

double degrees_apart(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * 180 / std::numbers::pi;
}

void expect_near(const Found& now, const std::string& joint, double mm, double most_degrees) {
  const Joint &is = now.joint(joint), &was = whole().joint(joint);
  const Vector3d axis = was.axes.col(0);
  Vector3d off = is.center - was.center;
  if (was.kind == JointKind::hinge) off -= axis * axis.dot(off);
  EXPECT_LT(off.norm(), mm) << joint;
  EXPECT_LT(degrees_apart(is.axes.col(0), axis), most_degrees) << joint;
  EXPECT_LT(degrees_apart(is.axes.col(2), was.axes.col(2)), most_degrees) << joint;
}

TEST(Damage, both_sides_of_a_symmetric_body_rest_alike) {
  for (const std::string joint : {"hip", "knee", "ankle"}) {
    const auto &left = whole().joint(joint + "_left").sequence,
               &right = whole().joint(joint + "_right").sequence;
    EXPECT_NEAR(left[0].rest, right[0].rest, 0.05) << joint;
  }
}

TEST(Damage, a_femur_cut_at_a_quarter_takes_its_hip_from_the_other_side) {
  const double top = whole().joint("hip_right").center.z(), knee = whole().joint("knee_right").center.z();
  const Found now =
      found(cut("thigh_right", [&](const Vector3d& p) { return p.z() < knee + 0.25 * (top - knee); }));
  expect_near(now, "hip_right", 15, 10);
  expect_near(now, "knee_right", 5, 5);
  EXPECT_LT(now.confidence("hip_right"), JointSources::least_confidence);
  EXPECT_TRUE(now.said("hip_right", "off the mirror image of hip_left, on a bone with"));
  // The root stays amid both, however badly one of them is known.
  EXPECT_LT((now.joint("pelvis").center - whole().joint("pelvis").center).norm(), 8);
  EXPECT_LT(now.confidence("pelvis"), JointSources::least_confidence);
}

TEST(Damage, a_femur_without_its_condyles_does_not_kick_sideways) {
  const double knee = whole().joint("knee_right").center.z();
  std::vector<CaseBone> bones = cut("thigh_right", [&](const Vector3d& p) { return p.z() > knee + 60; });
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(0.35, Vector3d::UnitY()).toRotationMatrix();
  for (CaseBone& bone : bones) bone.surface.V = bone.surface.V * tilt.transpose();
  const Found now = found(bones);
  EXPECT_LT(
      degrees_apart(now.joint("knee_right").axes.col(0), tilt * whole().joint("knee_right").axes.col(0)), 12);
  EXPECT_LT(now.confidence("knee_right"), JointSources::least_confidence);
}

TEST(Damage, a_root_with_one_hip_stays_in_the_middle) {
  std::vector<CaseBone> bones;
  for (const CaseBone& bone : legs()) {
    if (bone.segment == "pelvis" || bone.segment.ends_with("_left")) bones.push_back(bone);
  }
  const Found now = found(bones);
  EXPECT_LT((now.joint("pelvis").center - whole().joint("pelvis").center).norm(), 2);
  EXPECT_LT(now.confidence("pelvis"), JointSources::least_confidence);
  EXPECT_TRUE(now.said("pelvis", "hip_right has no bone: its centre lies beside hip_left"));
}

TEST(Damage, a_shank_that_ends_early_has_its_ankle_and_its_long_axis_from_the_other) {
  const double top = whole().joint("knee_right").center.z(), ankle = whole().joint("ankle_right").center.z();
  const Found now =
      found(cut("shank_right", [&](const Vector3d& p) { return p.z() > ankle + 0.7 * (top - ankle); }));
  expect_near(now, "ankle_right", 5, 10);
  expect_near(now, "knee_right", 5, 10);
  EXPECT_LT(now.confidence("ankle_right"), JointSources::least_confidence);
  EXPECT_TRUE(now.said("ankle_right", "off the mirror image of ankle_left"));
}

TEST(Damage, a_mirrored_body_has_mirrored_joints) {
  std::vector<CaseBone> bones = cut(
      "thigh_left", [&](const Vector3d& p) { return p.z() > whole().joint("knee_left").center.z() + 60; });
  const Found one = found(bones);
  for (CaseBone& bone : bones) {
    bone.surface = mirrored(bone.surface);
    const std::string other = other_side(bone.segment);
    if (!other.empty()) bone.segment = other;
  }
  const Found other = found(bones);
  for (const Segment& segment : one.rig.skeleton.segments) {
    const std::string twin = other_side(segment.joint.name);
    const Joint& is = other.joint(twin.empty() ? segment.joint.name : twin);
    const Vector3d at = Vector3d(-1, 1, 1).cwiseProduct(segment.joint.center);
    EXPECT_LT((is.center - at).norm(), 0.1) << segment.joint.name;
  }
}

TEST(Damage, both_femurs_cut_by_the_field_of_view_rest_as_bodies_do) {
  const double top = whole().joint("hip_right").center.z();
  std::vector<CaseBone> bones;
  for (const CaseBone& bone : legs()) {
    if (bone.segment != "pelvis" && !bone.segment.starts_with("thigh")) continue;
    bones.push_back(bone);
    if (bone.segment != "pelvis")
      bones.back().surface = test::part_of(bone.surface, [&](const Vector3d& p) { return p.z() > top - 60; });
  }
  const Found now = found(bones);
  for (const std::string side : {"left", "right"}) {
    for (const AngleAxis& angle : now.joint("hip_" + side).sequence)
      EXPECT_LT(std::abs(angle.rest), 15 * std::numbers::pi / 180) << side << " " << angle.name;
    EXPECT_LT(now.confidence("hip_" + side), JointSources::least_confidence);
  }
}

TEST(Damage, axes_of_a_body_that_lies_askew_are_not_called_sure) {
  // A whole pelvis shows how the body lies; what is left of this one does not.
  double low = 1e9, high = -1e9;
  for (const CaseBone& bone : legs()) {
    if (bone.segment != "pelvis") continue;
    low = std::min(low, bone.surface.V.col(2).minCoeff());
    high = std::max(high, bone.surface.V.col(2).maxCoeff());
  }
  EXPECT_GT(whole().confidence("pelvis"), 0.5);
  for (const auto& [degrees, sure] : {std::pair(5.0, true), std::pair(25.0, false)}) {
    std::vector<CaseBone> bones =
        cut("pelvis", [&](const Vector3d& p) { return p.z() < low + 0.6 * (high - low); });
    const Eigen::Matrix3d tilt =
        Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vector3d::UnitX()).toRotationMatrix();
    for (CaseBone& bone : bones) bone.surface.V = bone.surface.V * tilt.transpose();
    const Found now = found(bones);
    EXPECT_EQ(now.confidence("pelvis") > 0.5, sure) << degrees;
    EXPECT_NE(now.said("pelvis", "its axes are the scan's, in which the body lies askew by"), sure)
        << degrees;
  }
}

// Thighs up to `above` mm over the knee, shanks and feet: what a scan of knees shows.
std::vector<CaseBone> from_the_knees_down(double above) {
  const double top = whole().joint("knee_right").center.z() + above;
  std::vector<CaseBone> bones;
  for (const CaseBone& bone : legs()) {
    if (bone.segment == "pelvis") continue;
    bones.push_back(bone);
    if (bone.segment.starts_with("thigh"))
      bones.back().surface = test::part_of(bone.surface, [&](const Vector3d& p) { return p.z() < top; });
  }
  return bones;
}

TEST(Damage, hips_at_the_edge_of_a_scan_do_not_say_how_the_body_lies) {
  for (const double above : {10.0, 30.0, 80.0}) {
    const Found now = found(from_the_knees_down(above));
    for (const std::string joint : {"pelvis", "ankle_left", "ankle_right"})
      EXPECT_FALSE(now.said(joint, "askew")) << joint << " " << above;
    EXPECT_GT(now.confidence("ankle_left"), 0.9 * whole().confidence("ankle_left")) << above;
  }
}

TEST(Damage, a_stump_of_a_femur_does_not_turn_its_knee) {
  for (const double above : {5.0, 10.0, 20.0, 40.0}) {
    const Found now = found(from_the_knees_down(above));
    for (const std::string joint : {"knee_left", "knee_right"}) {
      EXPECT_LT(degrees_apart(now.joint(joint).axes.col(0), whole().joint(joint).axes.col(0)), 25)
          << joint << " " << above;
      EXPECT_LT(now.confidence(joint), JointSources::least_confidence) << joint << " " << above;
      EXPECT_TRUE(now.said(joint, "too short to show") || now.said(joint, "its axes have confidence"))
          << joint << " " << above;
    }
  }
}

TEST(Damage, nothing_is_mirrored_from_a_stump) {
  const double knee = whole().joint("knee_right").center.z();
  std::vector<CaseBone> bones = from_the_knees_down(40);
  for (CaseBone& bone : bones) {
    if (bone.segment == "thigh_right")
      bone.surface = test::part_of(bone.surface, [&](const Vector3d& p) { return p.z() < knee + 5; });
  }
  const Found now = found(bones);
  EXPECT_FALSE(now.said("knee_right", "off the mirror image of knee_left"));
  EXPECT_FALSE(now.said("knee_left", "off the mirror image of knee_right"));
}

TEST(Damage, a_child_has_an_adults_joints_scaled) {
  for (const double scale : {0.4, 0.5, 0.6}) {
    std::vector<CaseBone> bones = legs();
    for (CaseBone& bone : bones) bone.surface.V *= scale;
    const Found now = found(bones);
    for (const std::string joint : {"pelvis", "hip_left", "hip_right"}) {
      EXPECT_LT((now.joint(joint).center - scale * whole().joint(joint).center).norm(), 0.5)
          << joint << " " << scale;
      EXPECT_GT(now.confidence(joint), whole().confidence(joint) - 0.05) << joint << " " << scale;
    }
  }
}

TEST(Damage, a_cut_femur_is_not_a_childs) {
  const double top = whole().joint("hip_right").center.z(), knee = whole().joint("knee_right").center.z();
  EXPECT_EQ(body_scale(test::human_case(legs())), 1);
  for (const auto& [from, to] : {std::pair(0.0, 0.5), std::pair(0.5, 1.2), std::pair(0.3, 0.7)}) {
    std::vector<CaseBone> bones;
    for (const CaseBone& bone : legs()) {
      if (!bone.segment.starts_with("thigh")) continue;
      bones.push_back(bone);
      bones.back().surface = test::part_of(bone.surface, [&, from = from, to = to](const Vector3d& p) {
        const double share = (p.z() - knee) / (top - knee);
        return share > from - (from > 0 ? 0 : 1) && share < to;
      });
    }
    EXPECT_EQ(body_scale(test::human_case(bones)), 1) << from << " to " << to;
  }
  Case own = test::human_case(legs());
  for (CaseBone& bone : own.bones) bone.surface.V *= 0.5;
  EXPECT_NEAR(body_scale(own), 0.5, 0.1);
  own.skeleton.name = "my_own";
  EXPECT_EQ(body_scale(own), 1) << "what its bones are like is not known";
}

TEST(Damage, a_hinge_on_the_cut_end_of_a_stub_is_not_called_sure) {
  const double top = whole().joint("hip_right").center.z();
  for (const double left : {90.0, 40.0}) {
    const Found now = found(cut("thigh_right", [&](const Vector3d& p) { return p.z() > top - left; }));
    const double off = (now.joint("knee_right").center - whole().joint("knee_right").center).norm();
    EXPECT_TRUE(off < 30 || now.confidence("knee_right") < JointSources::least_confidence)
        << left << " mm left: " << off << " mm off at " << now.confidence("knee_right");
  }
}

TEST(OtherSide, names) {
  EXPECT_EQ(other_side("thigh_left"), "thigh_right");
  EXPECT_EQ(other_side("thigh_right"), "thigh_left");
  EXPECT_EQ(other_side("pelvis"), "");
  EXPECT_EQ(other_side("_left"), "");
}

TEST(OtherSide, a_piece_is_laid_onto_its_mirrored_fellow) {
  const SurfaceMesh femur = phantom::isosurface(phantom::femur_bone(phantom::make_landmarks(3)), 4, {});
  const Eigen::Affine3d turn =
      Eigen::Translation3d(20, -30, 40) * Eigen::AngleAxisd(0.6, Vector3d(1, 2, 3).normalized());
  SurfaceMesh other = mirrored(femur);
  const double low = other.V.col(2).minCoeff(), high = other.V.col(2).maxCoeff();
  SurfaceMesh piece =
      test::part_of(other, [&](const Vector3d& p) { return p.z() < low + 0.3 * (high - low); });
  for (Eigen::Index v = 0; v < piece.V.rows(); ++v)
    piece.V.row(v) = (turn * piece.V.row(v).transpose()).transpose();
  const auto laid = laid_onto(femur, piece);
  ASSERT_TRUE(laid);
  EXPECT_LT(laid->share, 0.4);
  EXPECT_LT(laid->rms_mm, 1);
  const Vector3d p(80, 10, 900);
  EXPECT_LT((laid->map * p - turn * Vector3d(-80, 10, 900)).norm(), 10);
  EXPECT_FALSE(laid_onto({}, piece));
  EXPECT_FALSE(laid_onto(test::ball({0, 0, 0}, 400, 12), femur)) << "no two bones";
}

}  // namespace
}  // namespace ecorche::rig
