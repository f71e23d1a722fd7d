// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/unit/phantom/mesh_checks.hpp"
#include "tests/unit/phantom/small_phantom.hpp"

namespace ecorche::phantom {
namespace {

TEST(Skeleton, IsWellFormed) {
  const Skeleton& truth = small_phantom().truth;
  std::set<std::string> names, joints;
  for (std::size_t i = 0; i < truth.segments.size(); ++i) {
    const Segment& segment = truth.segments[i];
    EXPECT_LT(segment.parent, static_cast<int>(i));
    EXPECT_EQ(segment.parent < 0, i == 0);
    EXPECT_TRUE(names.insert(segment.name).second);
    EXPECT_TRUE(joints.insert(segment.joint.name).second);
    EXPECT_EQ(segment.joint.rule, CenterRule::given);
    EXPECT_NEAR(segment.joint.axes.determinant(), 1, 1e-12) << segment.name;
    EXPECT_LT((segment.joint.axes.transpose() * segment.joint.axes - Eigen::Matrix3d::Identity()).norm(),
              1e-12);
    ASSERT_EQ(segment.joint.sequence.size(), 3);
    std::set<int> axes;
    for (const AngleAxis& angle : segment.joint.sequence) {
      axes.insert(angle.axis);
      EXPECT_LE(angle.min, angle.rest) << segment.joint.name << " " << angle.name;
      EXPECT_GE(angle.max, angle.rest) << segment.joint.name << " " << angle.name;
    }
    EXPECT_EQ(axes.size(), 3);
  }
}

TEST(Skeleton, PatientLeavesTheBallsToTheFit) {
  const Case& patient = small_phantom().patient;
  int fitted = 0;
  for (const Segment& segment : patient.skeleton.segments) {
    if (segment.joint.rule != CenterRule::sphere_fit) continue;
    ++fitted;
    for (const std::string& bone : {segment.joint.center_bone, segment.joint.facing_bone}) {
      EXPECT_TRUE(std::any_of(patient.bones.begin(), patient.bones.end(), [&](const CaseBone& b) {
        return b.name == bone;
      })) << bone;
    }
  }
  EXPECT_EQ(fitted, 4);
}

TEST(Skeleton, RestAnglesDescribeTheStandingBody) {
  const Skeleton& truth = small_phantom().truth;
  const auto rest_deg = [&](const char* joint, std::size_t i) {
    return truth.segments[static_cast<std::size_t>(truth.find_joint(joint))].joint.sequence[i].rest * 180 /
           3.14159265358979323846;
  };
  for (const char* side : {"_left", "_right"}) {
    const std::string shoulder = std::string("shoulder") + side, hip = std::string("hip") + side,
                      elbow = std::string("elbow") + side;
    EXPECT_NEAR(rest_deg(shoulder.c_str(), 1), -14, 2);  // abducted
    EXPECT_NEAR(rest_deg(hip.c_str(), 1), -5, 2);
    EXPECT_NEAR(rest_deg(elbow.c_str(), 0), 17, 0.1);
  }
}

TEST(Skeleton, RightIsTheMirrorImageOfLeft) {
  const Skeleton& truth = small_phantom().truth;
  for (const Segment& left : truth.segments) {
    if (!left.name.ends_with("_left")) continue;
    const int row = truth.find_segment(left.name.substr(0, left.name.size() - 5) + "_right");
    ASSERT_GE(row, 0);
    const Joint& right = truth.segments[static_cast<std::size_t>(row)].joint;
    EXPECT_EQ(right.center, Vec(-left.joint.center.x(), left.joint.center.y(), left.joint.center.z()));
    for (std::size_t i = 0; i < 3; ++i) {
      const AngleAxis &l = left.joint.sequence[i], &r = right.sequence[i];
      EXPECT_EQ(l.name, r.name);
      EXPECT_NEAR(l.rest, r.rest, 1e-12) << left.name << " " << l.name;
      EXPECT_EQ(l.min, r.min);
      // The same anatomical angle is the mirrored turn: axis x is shared, y and z change their sense.
      const Vec la = l.sign * left.joint.axes.col(l.axis), ra = r.sign * right.axes.col(r.axis);
      EXPECT_LT((ra - Vec(la.x(), -la.y(), -la.z())).norm(), 1e-12) << left.name << " " << l.name;
    }
  }
}

}  // namespace
}  // namespace ecorche::phantom
