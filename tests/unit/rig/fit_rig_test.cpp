// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/fit_rig.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/rig/balls.hpp"

namespace ecorche::rig {
namespace {

const Eigen::Vector3d kHip(90, 12, 880);

Segment segment(const std::string& name, int parent,
                const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) {
  Segment s;
  s.name = name;
  s.parent = parent;
  s.joint.name = name + "_joint";
  s.joint.center = center;
  return s;
}

// A ball with a neck's lump in a hemispherical socket, both noisy; hip by sphere fit.
Case hip_case() {
  Case patient;
  patient.name = "hip";
  patient.skeleton.name = "two";
  patient.skeleton.segments = {segment("pelvis", -1), segment("thigh", 0)};
  Joint& hip = patient.skeleton.segments[1].joint;
  hip.rule = CenterRule::sphere_fit;
  hip.center_bone = "femur";
  hip.facing_bone = "hip_bone";
  const auto upper = [](const Eigen::Vector3d& p) { return p.z() > kHip.z() - 1; };
  patient.bones = {
      {"hip_bone", "pelvis", test::part_of(test::ball(kHip, 27, 24, 0.3, true), upper)},
      {"femur", "thigh",
       test::joined(test::ball(kHip, 24, 24, 0.3), test::ball(kHip - Eigen::Vector3d(0, 0, 45), 22, 12))},
  };
  return patient;
}

struct Heard {
  std::vector<std::string> warnings;
  Context context;
  Heard() {
    context.log = [this](LogLevel level, std::string_view line) {
      if (level == LogLevel::warning) warnings.emplace_back(line);
    };
  }
};

// The error of `fit`, or a failed test.
Error refusal(const Case& patient) {
  try {
    fit(patient, {});
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "accepted";
  return Error(ErrorKind::internal, "", "", "");
}

TEST(FitRig, a_ball_in_a_socket_is_found_within_half_a_millimetre) {
  Heard heard;
  const Rig rig = fit(hip_case(), heard.context);
  ASSERT_EQ(rig.fits.size(), 2U);
  EXPECT_LT((rig.skeleton.segments[1].joint.center - kHip).norm(), 0.5);
  EXPECT_NEAR(rig.fits[1].radius_mm, 24, 0.5);
  EXPECT_LT(rig.fits[1].residual_mm, 0.6);
  EXPECT_GT(rig.fits[1].inlier_share, 0.95);
  EXPECT_GT(rig.fits[1].points, 100);
  EXPECT_EQ(rig.fits[1].rule, CenterRule::sphere_fit);
  EXPECT_TRUE(heard.warnings.empty()) << heard.warnings[0];
}

TEST(FitRig, the_socket_gives_the_same_centre) {
  Case patient = hip_case();
  std::swap(patient.skeleton.segments[1].joint.center_bone, patient.skeleton.segments[1].joint.facing_bone);
  EXPECT_LT((fit(patient, {}).skeleton.segments[1].joint.center - kHip).norm(), 0.5);
}

TEST(FitRig, given_centres_are_kept) {
  Case patient = hip_case();
  Joint& hip = patient.skeleton.segments[1].joint;
  hip.rule = CenterRule::given;
  hip.center = {1, 2, 3};
  const Rig rig = fit(patient, {});
  EXPECT_EQ(rig.skeleton.segments[1].joint.center, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(rig.fits[1].residual_mm, 0);
  EXPECT_EQ(rig.fits[1].inlier_share, 1);
}

TEST(FitRig, a_bad_sphere_is_a_warning_with_its_number) {
  Case patient = hip_case();
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 6);
  for (Eigen::Index v = 0; v < patient.bones[1].surface.V.rows(); ++v) {
    for (int c = 0; c < 3; ++c) patient.bones[1].surface.V(v, c) += noise(random);
  }
  Heard heard;
  const Rig rig = fit(patient, heard.context);
  ASSERT_FALSE(heard.warnings.empty());
  EXPECT_NE(heard.warnings[0].find("thigh_joint"), std::string::npos);
  EXPECT_GT(rig.fits[1].residual_mm, 0.1 * rig.fits[1].radius_mm);
}

TEST(FitRig, segments_without_bones_go_into_their_nearest_present_ancestor) {
  Case patient;
  patient.name = "part";
  patient.skeleton.name = "leg";
  patient.skeleton.segments = {segment("pelvis", -1), segment("thigh", 0, {0, 0, 1}),
                               segment("shank", 1, {0, 0, 2}), segment("foot", 2, {0, 0, 3}),
                               segment("toes", 3, {0, 0, 4})};
  patient.skeleton.segments[4].joint.coupled = {{"thigh_joint", "flexion", "bend", 0.5},
                                                {"foot_joint", "flexion", "bend", 0.5}};
  patient.bones = {{"femur", "thigh", test::ball({0, 0, 0}, 5, 4)},
                   {"toe", "toes", test::ball({0, 0, 9}, 5, 4)}};
  Heard heard;
  const Rig rig = fit(patient, heard.context);
  ASSERT_EQ(rig.skeleton.segments.size(), 3U);
  EXPECT_EQ(rig.skeleton.segments[0].name, "pelvis");  // the root stays, boned or not
  EXPECT_EQ(rig.skeleton.segments[2].name, "toes");
  EXPECT_EQ(rig.skeleton.segments[2].parent, 1);
  EXPECT_EQ(rig.skeleton.segments[2].joint.center, Eigen::Vector3d(0, 0, 4));
  ASSERT_EQ(rig.skeleton.segments[2].joint.coupled.size(), 1U);  // the foot, a leader, is gone
  EXPECT_EQ(rig.skeleton.segments[2].joint.coupled[0].joint, "thigh_joint");
  ASSERT_EQ(heard.warnings.size(), 2U);
  EXPECT_NE(heard.warnings[0].find("shank"), std::string::npos);
  EXPECT_NE(heard.warnings[0].find("thigh"), std::string::npos);
  EXPECT_NE(heard.warnings[1].find("foot"), std::string::npos);
  EXPECT_NE(heard.warnings[1].find("thigh"), std::string::npos);
}

TEST(FitRig, mistakes_are_refused_by_name) {
  Case patient = hip_case();
  patient.skeleton.segments[1].joint.facing_bone = "ilium";
  EXPECT_EQ(refusal(patient).kind(), ErrorKind::config);
  EXPECT_NE(
      std::string(refusal(patient).what()).find("its sphere fit names bone 'ilium', which the case has not"),
      std::string::npos);
  EXPECT_EQ(refusal(patient).where(), "joint thigh_joint");

  patient = hip_case();
  patient.bones.clear();
  EXPECT_EQ(refusal(patient).kind(), ErrorKind::config);
  EXPECT_EQ(refusal(patient).problem(), "no segment owns a bone");
  patient.generic = true;
  EXPECT_STREQ(
      refusal(patient).what(),
      ("case " + patient.name + ": no segment owns a bone (list the case's bones with their segments)")
          .c_str());

  patient = hip_case();
  patient.bones[0].segment = "wing";
  EXPECT_NE(refusal(patient).problem().find("its segment 'wing' is not in skeleton '"), std::string::npos);

  patient = hip_case();
  patient.bones[1].surface.V.col(2).setConstant(0);  // flat: no sphere anywhere
  EXPECT_EQ(refusal(patient).kind(), ErrorKind::data);
  EXPECT_NE(
      std::string(refusal(patient).what()).find("the vertices of femur that face hip_bone lie on no sphere"),
      std::string::npos);

  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  EXPECT_THROW(fit(hip_case(), context), Error);
}

}  // namespace
}  // namespace ecorche::rig
