// SPDX-License-Identifier: Apache-2.0
// Joints by rules on named regions: every source, what stands in for one that cannot be followed, and
// mistakes.
#include <gtest/gtest.h>

#include <numbers>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/values/joint_rule.hpp>
#include "preprocess/rig/fit_rig.hpp"
#include "tests/unit/rig/balls.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Vector3d;
using Kind = DirectionSource::Kind;

Segment segment_by(const std::string& name, int parent, JointRule rule = {}) {
  Segment s;
  s.name = name;
  s.parent = parent;
  s.joint.name = name + "_joint";
  s.joint.rule = rule.center.rule;
  s.joint.sequence = {
      {.name = "flexion", .axis = 0}, {.name = "adduction", .axis = 1}, {.name = "rotation", .axis = 2}};
  s.joint.how = std::make_shared<const JointRule>(std::move(rule));
  return s;
}

PointSource at(CenterRule rule, const std::string& region) {
  PointSource source;
  source.rule = rule;
  source.on.region = region;
  return source;
}

PointSource of_joint(const std::string& name) {
  PointSource source;
  source.rule = CenterRule::joint;
  source.joint = name;
  return source;
}

DirectionSource from_to(PointSource from, PointSource to) {
  DirectionSource source;
  source.kind = Kind::towards;
  source.from = std::move(from);
  source.to = std::move(to);
  return source;
}

DirectionSource given(const Vector3d& along) {
  DirectionSource source;
  source.direction = along;
  return source;
}

// Two balls 100 mm apart in one bone of each of two segments; `high` and `low` are boxes round them.
Case two_segments(JointRule rule) {
  Case patient;
  patient.name = "two";
  patient.skeleton.name = "two";
  patient.skeleton.segments = {segment_by("base", -1), segment_by("tip", 0, std::move(rule))};
  const SurfaceMesh bone = test::joined(test::ball({0, 0, 100}, 24, 16), test::ball({10, 0, 0}, 15, 16));
  patient.bones = {{"base_bone", "base", test::ball({0, 0, 150}, 20, 16)}, {"tip_bone", "tip", bone}};
  Region high, low;
  high.name = "high";
  high.bone = "tip_bone";
  high.boxes = {{Vector3d(-30, -30, 75), Vector3d(30, 30, 125)}};
  low.name = "low";
  low.segment = "tip";
  low.of_bones = true;
  low.boxes = {{Vector3d(0, 0, 0), Vector3d(1, 1, 0.25)}};
  patient.regions = {high, low};
  return patient;
}

Joint fitted(const Case& patient) {
  return fit(patient, {}).skeleton.segments[1].joint;
}

TEST(Rules, boxes_in_millimetres_and_in_shares_of_the_bones) {
  JointRule rule;
  rule.center = at(CenterRule::sphere_fit, "high");
  EXPECT_LT((fitted(two_segments(rule)).center - Vector3d(0, 0, 100)).norm(), 1e-6);
  rule.center = at(CenterRule::centroid, "low");  // 30 of 139 mm of the box are the whole lower ball
  EXPECT_LT((fitted(two_segments(rule)).center - Vector3d(10, 0, 0)).norm(), 1e-6);
}

TEST(Rules, points_find_the_vertices_nearest_to_them_on_another_surface) {
  JointRule rule;
  rule.center = at(CenterRule::sphere_fit, "marked");
  Case patient = two_segments(rule);
  Region marked;
  marked.name = "marked";
  marked.bone = "tip_bone";
  marked.points = test::ball({0.4, -0.3, 100.5}, 24.3, 9).V;
  patient.regions.push_back(marked);
  const Rig rig = fit(patient, {});
  EXPECT_LT((rig.skeleton.segments[1].joint.center - Vector3d(0, 0, 100)).norm(), 1e-6);
  EXPECT_LE(rig.fits[1].points, marked.points.rows());
  EXPECT_EQ(rig.fits[1].rule, CenterRule::sphere_fit);
  EXPECT_GT(rig.fits[1].confidence, 0.99);
}

TEST(Rules, a_frame_from_two_vectors_and_their_cross_product) {
  JointRule rule;
  rule.center.rule = CenterRule::between;
  rule.center.parts = {at(CenterRule::centroid, "low"), at(CenterRule::sphere_fit, "high")};
  rule.center.share = 0.25;
  rule.axes = {{2, from_to(at(CenterRule::centroid, "low"), at(CenterRule::sphere_fit, "high"))},
               {0, given(Vector3d(1, 0, 0))}};
  rule.measured_rest = true;
  const Joint joint = fitted(two_segments(rule));
  EXPECT_LT((joint.center - Vector3d(7.5, 0, 25)).norm(), 1e-6);
  const double lean = std::atan2(10, 100);
  EXPECT_LT((joint.axes.col(2) - Vector3d(-std::sin(lean), 0, std::cos(lean))).norm(), 1e-6);
  EXPECT_LT((joint.axes.col(0) - Vector3d(std::cos(lean), 0, std::sin(lean))).norm(), 1e-6);
  EXPECT_LT((joint.axes.col(1) - Vector3d(0, 1, 0)).norm(), 1e-6);
  // The base has the axes of LPS: the scan is a turn about y alone.
  EXPECT_NEAR(joint.sequence[0].rest, 0, 1e-9);
  EXPECT_NEAR(joint.sequence[1].rest, -lean, 1e-6);
  EXPECT_NEAR(joint.sequence[2].rest, 0, 1e-9);
  // All angles zero: the frames are parallel.
  const Eigen::Matrix3d zero =
      joint.axes * kinematics::rotation_from_angles(joint, {0, 0, 0}).toRotationMatrix();
  EXPECT_LT((zero - Eigen::Matrix3d::Identity()).norm(), 1e-6);
}

TEST(Rules, the_first_source_that_is_found_well_is_taken) {
  JointRule rule;
  rule.center.rule = CenterRule::first_good;
  PointSource absent = at(CenterRule::sphere_fit, "");
  absent.on.bone = "nobody";
  rule.center.parts = {absent, of_joint("nobody_joint"), at(CenterRule::centroid, "low")};
  DirectionSource any;
  any.kind = Kind::first_good;
  any.choices = {from_to(of_joint("nobody_joint"), of_joint("base_joint")), given(Vector3d(0, 1, 0))};
  rule.axes = {{1, any}, {2, given(Vector3d(0, 0, 1))}};
  const Rig rig = fit(two_segments(rule), {});
  EXPECT_EQ(rig.fits[1].rule, CenterRule::centroid);
  // A ball of 15 mm has its vertices 15 mm about their mean; and a direction among others stands for none.
  EXPECT_NEAR(rig.fits[1].residual_mm, 15, 1e-6);
  EXPECT_NEAR(rig.fits[1].confidence, 0.1, 1e-9);
  EXPECT_EQ(rig.skeleton.segments[1].joint.axes, Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
  EXPECT_EQ(rig.skeleton.segments[1].joint.how, nullptr);  // all is said
}

// An arm stretched out sidewards: its long axis is where the flexion axis of a hanging one would be.
TEST(Rules, of_several_directions_none_along_the_first_axis_is_taken) {
  JointRule rule;
  DirectionSource any;
  any.kind = Kind::first_good;
  any.choices = {given(Vector3d(1, 0, 0.01).normalized()), given(Vector3d(0, 0, 1))};
  rule.axes = {{2, given(Vector3d(-1, 0, 0))}, {0, any}};
  const Eigen::Matrix3d axes = fitted(two_segments(rule)).axes;
  EXPECT_EQ(axes.col(2), Vector3d(-1, 0, 0));
  EXPECT_EQ(axes.col(0), Vector3d(0, 0, 1));
  EXPECT_EQ(axes.col(1), Vector3d(0, 1, 0));
}

TEST(Rules, a_rule_that_cannot_be_followed_lies_between_the_nearest_surfaces_and_is_a_warning) {
  JointRule rule;
  rule.center = at(CenterRule::sphere_fit, "");
  rule.center.on.bone = "nobody";
  rule.axes = {{0, from_to(of_joint("nobody_joint"), of_joint("base_joint"))}, {2, given(Vector3d(0, 0, 1))}};
  std::vector<std::string> warnings;
  Context context;
  context.log = [&](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) warnings.emplace_back(line);
  };
  const Rig rig = fit(two_segments(rule), context);
  EXPECT_EQ(rig.fits[1].rule, CenterRule::facing);
  EXPECT_EQ(rig.fits[1].confidence, 0);
  const Vector3d& centre = rig.skeleton.segments[1].joint.center;  // the gap is from z 124 to 130
  EXPECT_LT(centre.head<2>().norm(), 0.5);
  EXPECT_NEAR(centre.z(), 127, 3);
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_NE(warnings[0].find("joint tip_joint: its rule cannot be followed in this case"), std::string::npos);
  EXPECT_NE(warnings[1].find("joint tip_joint: its axes have confidence 0 %"), std::string::npos);
}

TEST(Rules, a_poor_fit_is_a_warning_with_its_numbers) {
  JointRule rule;
  rule.center = at(CenterRule::cylinder_fit, "");
  rule.center.on.segment = "base";
  Case patient = two_segments(rule);
  patient.bones[0].surface.V = 40 * Points::Random(patient.bones[0].surface.V.rows(), 3);
  std::string heard;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { heard += line; };
  const Rig rig = fit(patient, context);
  EXPECT_LT(rig.fits[1].confidence, 0.5);
  EXPECT_NE(heard.find("joint tip_joint: its centre by cylinder_fit has confidence"), std::string::npos)
      << heard;
}

std::string refusal(const Case& patient, ErrorKind kind) {
  try {
    fit(patient, {});
  } catch (const Error& error) {
    EXPECT_EQ(static_cast<int>(error.kind()), static_cast<int>(kind));
    return error.what();
  }
  return "accepted";
}

TEST(Rules, circles_and_collinear_axes_are_refused) {
  JointRule rule;
  rule.center = of_joint("tip_joint");
  EXPECT_NE(refusal(two_segments(rule), ErrorKind::config).find("its rule leads back to the joint itself"),
            std::string::npos);
  rule = {};
  rule.axes = {{0, given(Vector3d(1, 0, 0))}, {2, given(Vector3d(1, 0, 0.05))}};
  EXPECT_NE(refusal(two_segments(rule), ErrorKind::data).find("its two axes come out collinear"),
            std::string::npos);
}

TEST(Rules, a_mean_of_vertices_is_as_sure_as_they_lie_close_together) {
  JointRule rule;
  rule.center = at(CenterRule::centroid, "low");
  std::string heard;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { heard += line; };
  Case patient = two_segments(rule);
  EXPECT_NEAR(fit(patient, context).fits[1].confidence, 1 / (1 + 1.5 * 1.5), 1e-9);
  EXPECT_NE(
      heard.find("joint tip_joint: its centre by centroid has confidence 31 % (the mean of 482 vertices "
                 "that lie 15 mm about it)"),
      std::string::npos)
      << heard;
  // A hinge may lie anywhere along its axis: two thirds of the squares remain.
  patient.skeleton.segments[1].joint.kind = JointKind::hinge;
  EXPECT_NEAR(fit(patient, {}).fits[1].confidence, 1 / (1 + 1.5), 0.03);
}

TEST(Rules, boxes_near_a_segment_lie_in_widths_of_the_bones_end) {
  JointRule rule;
  rule.center = at(CenterRule::sphere_fit, "end");
  Case patient = two_segments(rule);
  Region end;
  end.name = "end";
  end.segment = "tip";
  end.near = "base";
  end.boxes = {{Vector3d(-2, -2, -0.1), Vector3d(2, 2, 0.9)}};  // the upper ball of 48 mm
  patient.regions.push_back(end);
  std::vector<JointEvidence> evidence;
  const Rig rig = fit(patient, {}, &evidence);
  EXPECT_LT((rig.skeleton.segments[1].joint.center - Vector3d(0, 0, 100)).norm(), 1e-6);
  ASSERT_EQ(evidence.size(), 2U);
  EXPECT_EQ(evidence[1].rule, CenterRule::sphere_fit);
  EXPECT_NEAR(evidence[1].radius, 24, 1e-6);
  EXPECT_EQ(static_cast<int>(evidence[1].vertices.size()), rig.fits[1].points);
  EXPECT_GT(evidence[1].vertices[0].z(), 70);
  patient.regions.back().near = "nobody";
  EXPECT_EQ(fit(patient, {}).fits[1].rule, CenterRule::facing);
}

// A ball whose one side has three times as many vertices: those found count by area, marked ones one by one.
TEST(Rules, a_found_part_has_its_middle_by_area) {
  JointRule rule;
  rule.center = at(CenterRule::centroid, "end");
  Case patient = two_segments(rule);
  const auto side = [](int rings, double sign) {
    return test::part_of(test::ball({0, 0, 100}, 24, rings),
                         [&](const Vector3d& p) { return sign * p.x() > -1e-9; });
  };
  patient.bones[1].surface =
      test::joined(test::joined(side(16, 1), side(48, -1)), test::ball({10, 0, 0}, 15, 16));
  Region end;
  end.name = "end";
  end.segment = "tip";
  end.near = "base";
  end.boxes = {{Vector3d(-2, -2, -0.1), Vector3d(2, 2, 1.2)}};
  patient.regions.push_back(end);
  EXPECT_LT(std::abs(fitted(patient).center.x()), 0.5);
  patient.regions.back() = patient.regions.front();
  patient.regions.back().name = "end";
  EXPECT_LT(fitted(patient).center.x(), -5);
}

TEST(Rules, a_measured_rest_outside_its_limits_widens_them_and_says_so) {
  JointRule rule;
  rule.center = at(CenterRule::sphere_fit, "high");
  rule.axes = {{2, from_to(at(CenterRule::centroid, "low"), at(CenterRule::sphere_fit, "high"))},
               {0, given(Vector3d(1, 0, 0))}};
  rule.measured_rest = true;
  Case patient = two_segments(rule);
  for (AngleAxis& angle : patient.skeleton.segments[1].joint.sequence) {
    angle.min = -0.05;
    angle.max = 0.05;
  }
  std::string heard;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { heard += line; };
  const Joint joint = fit(patient, context).skeleton.segments[1].joint;
  EXPECT_NEAR(joint.sequence[1].min, -std::atan2(10, 100), 1e-6);
  EXPECT_EQ(joint.sequence[1].max, 0.05);
  EXPECT_EQ(joint.sequence[0].min, -0.05);
  EXPECT_NE(heard.find("joint tip_joint: adduction rests at -6 degrees, outside its limits: widened from -3, "
                       "for the scanned pose is allowed"),
            std::string::npos)
      << heard;
}

// A row of five balls that nobody joined, and one far to the side of the middle one.
TEST(Generic, the_tree_follows_the_gaps_and_hangs_from_the_middle) {
  Case patient;
  patient.name = "row";
  patient.generic = true;
  patient.skeleton.name = "generic";
  for (const int i : {3, 0, 4, 1, 2})
    patient.bones.push_back(
        {"bone_" + std::to_string(i), "part_" + std::to_string(i), test::ball({100.0 * i, 0, 0}, 48, 12)});
  patient.bones.push_back({"side", "side", test::ball({200, 0, 90}, 40, 12)});
  const Rig rig = fit(patient, {});
  const auto& segments = rig.skeleton.segments;
  ASSERT_EQ(segments.size(), 6U);
  EXPECT_EQ(segments[0].name, "part_2");
  EXPECT_EQ(segments[0].joint.kind, JointKind::free);
  const auto parent = [&](const std::string& name) {
    const int row = segments[static_cast<std::size_t>(rig.skeleton.find_segment(name))].parent;
    return row < 0 ? std::string() : segments[static_cast<std::size_t>(row)].name;
  };
  EXPECT_EQ(parent("part_1"), "part_2");
  EXPECT_EQ(parent("part_0"), "part_1");
  EXPECT_EQ(parent("part_3"), "part_2");
  EXPECT_EQ(parent("part_4"), "part_3");
  EXPECT_EQ(parent("side"), "part_2");
  for (const Segment& s : segments) {
    EXPECT_TRUE(s.joint.center.allFinite());
    EXPECT_EQ(s.joint.sequence.size(), 3U);
  }
}

}  // namespace
}  // namespace ecorche::rig
