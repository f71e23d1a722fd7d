// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/convert.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/toy_model.hpp"

namespace ecorche::wire {
namespace {

Pose bent(std::size_t joints) {
  Pose pose = Pose::rest(joints);
  pose.root_translation = {1.0 / 3, -2, 1e-300};
  for (std::size_t i = 0; i < joints; ++i) {
    pose.rotation[i] = Eigen::AngleAxisd(0.1 + static_cast<double>(i), Eigen::Vector3d(1, 2, 3).normalized());
  }
  pose.translation[joints - 1] = {0.1, 0.2, 0.3};
  return pose;
}

TEST(Convert, APoseArrivesBitForBit) {
  const Pose pose = bent(3);
  v1::PoseUpdate update;
  to_proto(pose, update);
  v1::PoseUpdate received;
  ASSERT_TRUE(received.ParseFromString(update.SerializeAsString()));
  Pose back;
  ASSERT_TRUE(from_proto(received, 3, back).ok());
  EXPECT_EQ(back.root_translation, pose.root_translation);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(back.rotation[i].coeffs(), pose.rotation[i].coeffs());
    EXPECT_EQ(back.translation[i], pose.translation[i]);
  }
}

TEST(Convert, BadPosesAreRefusedWithAReason) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double inf = std::numeric_limits<double>::infinity();
  const auto status_of = [](auto&& spoil) {
    v1::PoseUpdate update;
    to_proto(bent(3), update);
    spoil(update);
    Pose pose;
    return from_proto(update, 3, pose);
  };
  EXPECT_TRUE(status_of([](v1::PoseUpdate&) {}).ok());
  const Status count = status_of([](v1::PoseUpdate& u) { u.add_rotation(0); });
  EXPECT_EQ(count.code, StatusCode::invalid_argument);
  EXPECT_NE(count.message.find("13 rotation numbers"), std::string::npos) << count.message;
  EXPECT_EQ(status_of([](v1::PoseUpdate& u) { u.clear_rotation(); }).code, StatusCode::invalid_argument);
  for (const double bad : {nan, inf, -inf, 5.0, 0.0, 1e308}) {
    EXPECT_EQ(status_of([&](v1::PoseUpdate& u) {
                for (int i = 4; i < 8; ++i) u.set_rotation(i, bad);
              }).code,
              StatusCode::invalid_argument)
        << bad;
  }
  for (const double bad : {nan, inf, 1.1e6}) {
    EXPECT_FALSE(status_of([&](v1::PoseUpdate& u) { u.mutable_root_translation()->set_y(bad); }).ok()) << bad;
    EXPECT_FALSE(
        status_of([&](v1::PoseUpdate& u) { u.mutable_translation(0)->mutable_offset()->set_z(bad); }).ok())
        << bad;
  }
  for (const std::uint32_t joint : {0U, 3U, 0xffffffffU}) {
    EXPECT_FALSE(status_of([&](v1::PoseUpdate& u) { u.mutable_translation(0)->set_joint(joint); }).ok())
        << joint;
  }
}

TEST(Convert, ASkeletonComesBack) {
  const Model model = test::toy_model();
  v1::Skeleton skeleton;
  to_proto(model.rig, skeleton);
  Rig rig;
  ASSERT_TRUE(from_proto(skeleton, rig).ok());
  ASSERT_EQ(rig.skeleton.segments.size(), model.segment_count());
  for (std::size_t i = 0; i < rig.skeleton.segments.size(); ++i) {
    const Segment& a = rig.skeleton.segments[i];
    const Segment& b = model.rig.skeleton.segments[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.parent, b.parent);
    EXPECT_EQ(a.aliases, b.aliases);
    EXPECT_EQ(a.joint.name, b.joint.name);
    EXPECT_EQ(a.joint.kind, b.joint.kind);
    EXPECT_EQ(a.joint.center, b.joint.center);
    EXPECT_EQ(a.joint.axes, b.joint.axes);
    ASSERT_EQ(a.joint.sequence.size(), b.joint.sequence.size());
    for (std::size_t k = 0; k < a.joint.sequence.size(); ++k) {
      EXPECT_EQ(a.joint.sequence[k].name, b.joint.sequence[k].name);
      EXPECT_EQ(a.joint.sequence[k].axis, b.joint.sequence[k].axis);
      EXPECT_EQ(a.joint.sequence[k].sign, b.joint.sequence[k].sign);
      EXPECT_EQ(a.joint.sequence[k].rest, b.joint.sequence[k].rest);
      EXPECT_EQ(a.joint.sequence[k].min, b.joint.sequence[k].min);
      EXPECT_EQ(a.joint.sequence[k].max, b.joint.sequence[k].max);
    }
  }
}

TEST(Convert, CouplingsComeBackAndThoseToNothingAreRefused) {
  Rig rig = test::toy_model().rig;
  Joint& root = rig.skeleton.segments[0].joint;
  Joint& joint = rig.skeleton.segments[1].joint;
  const std::string lead = root.sequence.at(2).name;
  joint.coupled = {{root.name, lead, joint.sequence.at(1).name, 0.25},
                   {joint.name, joint.sequence.at(0).name, "y_mm", -2.5},
                   {"nowhere", lead, joint.sequence.at(1).name, 1}};
  v1::Skeleton skeleton;
  to_proto(rig, skeleton);
  Rig back;
  ASSERT_TRUE(from_proto(skeleton, back).ok());
  const std::vector<Coupling>& coupled = back.skeleton.segments[1].joint.coupled;
  ASSERT_EQ(coupled.size(), 2U);
  for (std::size_t i = 0; i < coupled.size(); ++i) {
    EXPECT_EQ(coupled[i].joint, joint.coupled[i].joint);
    EXPECT_EQ(coupled[i].angle, joint.coupled[i].angle);
    EXPECT_EQ(coupled[i].drives, joint.coupled[i].drives);
    EXPECT_EQ(coupled[i].ratio, joint.coupled[i].ratio);
  }
  v1::JointCoupling& first = *skeleton.mutable_segments(1)->mutable_joint()->mutable_coupled(0);
  first.set_angle(3);
  EXPECT_EQ(from_proto(skeleton, back).code, StatusCode::invalid_argument);
  first.set_angle(0);
  first.set_slide_axis(3);
  EXPECT_EQ(from_proto(skeleton, back).code, StatusCode::invalid_argument);
  first.set_slide_axis(2);
  EXPECT_TRUE(from_proto(skeleton, back).ok());
  first.set_joint(99);
  EXPECT_EQ(from_proto(skeleton, back).code, StatusCode::invalid_argument);
}

TEST(Convert, ASkeletonWithChildrenBeforeParentsIsRefused) {
  v1::Skeleton skeleton;
  to_proto(test::toy_model().rig, skeleton);
  Rig rig;
  for (const int parent : {-1, 1, 2, 7}) {
    skeleton.mutable_segments(1)->set_parent(parent);
    EXPECT_EQ(from_proto(skeleton, rig).code, StatusCode::invalid_argument) << parent;
  }
}

TEST(Convert, AGridComesBack) {
  ImageGrid grid{.size = {3, 4, 5},
                 .origin = {1, 2, 3},
                 .spacing = {0.5, 0.6, 0.7},
                 .direction = {0, 1, 0, -1, 0, 0, 0, 0, 1}};
  v1::Grid message;
  to_proto(grid, message);
  ImageGrid back;
  ASSERT_TRUE(from_proto(message, back).ok());
  EXPECT_EQ(back, grid);
  message.set_size_i(0x80000000U);
  EXPECT_FALSE(from_proto(message, back).ok());
  message.set_size_i(1);
  message.mutable_direction()->RemoveLast();
  EXPECT_FALSE(from_proto(message, back).ok());
}

TEST(Convert, AnUnknownStatusIsUnknown) {
  v1::Status status;
  status.set_code(77);
  EXPECT_EQ(from_proto(status).code, StatusCode::unknown);
}

}  // namespace
}  // namespace ecorche::wire
