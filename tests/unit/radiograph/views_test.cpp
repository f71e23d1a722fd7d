// SPDX-License-Identifier: Apache-2.0
// How views are hung, and what they are centred on.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <memory>

#include <ecorche/runtime/radiograph_views.hpp>
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

TEST(Views, HaveNamesBothWays) {
  for (const char* name : {"ap", "pa", "lateral_left", "lateral_right"})
    EXPECT_EQ(view_name(view_from_name(name)), name);
  try {
    view_from_name("lateral");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "view: there is no view 'lateral' (one of ap, pa, lateral_left, lateral_right)");
  }
}

// Where a point comes to lie in the picture: columns to the right, rows down, mm from its middle.
Eigen::Vector2d in_picture(const XRaySetup& setup, const Vector3d& point) {
  const Vector3d normal = setup.detector.right.cross(setup.detector.down);
  const Vector3d way = point - setup.source;
  const Vector3d on = setup.source +
                      way * normal.dot(setup.detector.centre - setup.source) / normal.dot(way) -
                      setup.detector.centre;
  return {setup.detector.right.dot(on), setup.detector.down.dot(on)};
}

TEST(Views, AreHungAsRadiologistsDo) {
  const RadiographTarget target{Vector3d(5, 30, 1200), 100, 120};
  const Vector3d left = target.centre + 10 * Vector3d::UnitX(),
                 front = target.centre - 10 * Vector3d::UnitY();
  const Vector3d head = target.centre + 10 * Vector3d::UnitZ();
  for (const View view : {View::ap, View::pa, View::lateral_left, View::lateral_right}) {
    const XRaySetup setup = positioned(view, target, 1000, 150, {});
    check(setup);
    EXPECT_NEAR(setup.source_to_detector(), 1000, 1e-9);
    EXPECT_NEAR(in_picture(setup, target.centre).norm(), 0, 1e-9);
    const Eigen::Vector2d up = in_picture(setup, head);
    EXPECT_NEAR(up.x(), 0, 1e-9);
    EXPECT_NEAR(up.y(), -10 * 1000.0 / 850, 1e-9);
    EXPECT_GT((setup.detector.centre - target.centre).dot(Beam(view).way()), 0);
    // The patient's left is on the picture's right, from front and back.
    if (view == View::ap || view == View::pa) {
      EXPECT_GT(in_picture(setup, left).x(), 5);
    } else {
      // The detector is at the side that the view is named after; one looks at the patient from there.
      EXPECT_EQ(setup.detector.centre.x() > setup.source.x(), view == View::lateral_left);
      EXPECT_EQ(in_picture(setup, front).x() < -5, view == View::lateral_left);
      EXPECT_EQ(in_picture(setup, front).x() > 5, view == View::lateral_right);
    }
  }
  EXPECT_THROW(positioned(View::ap, target, 100, 100, {}), Error);
  EXPECT_THROW(positioned(View::ap, target, 100, -1, {}), Error);
}

class TargetTest : public testing::Test {
 protected:
  TargetTest()
      : model(std::make_shared<const Model>(test::toy_model())), poser(model), body(poser.make_frame()) {
    Pose pose = Pose::rest(model->segment_count());
    // The hinge at z = 100 by a right angle.
    pose.rotation[1] = Eigen::AngleAxisd(1.5707963267948966, Vector3d::UnitX());
    EXPECT_TRUE(poser.run(pose, Skinning::lbs, {}, body).ok());
  }
  std::shared_ptr<const Model> model;
  BodyPoser poser;
  PosedBody body;
};

TEST_F(TargetTest, IsTheMiddleOfWhatIsPosed) {
  const Eigen::Map<const PointsF> nodes(body.nodes.data(), model->nodes.rows(), 3);
  const Vector3d low = nodes.colwise().minCoeff().transpose().cast<double>();
  const Vector3d high = nodes.colwise().maxCoeff().transpose().cast<double>();
  const RadiographTarget whole = target_body(*model, body, View::ap);
  EXPECT_NEAR((whole.centre - (low + high) / 2).norm(), 0, 1e-3);
  EXPECT_NEAR(whole.behind_mm, high.y() - whole.centre.y(), 1e-3);
  EXPECT_NEAR(whole.before_mm, whole.centre.y() - low.y(), 1e-3);

  const RadiographTarget joint = target_joint(*model, body, View::lateral_left, 1);
  EXPECT_NEAR((joint.centre - model->rig.skeleton.segments[1].joint.center).norm(), 0, 1e-3);
  const RadiographTarget tip = target_segment(*model, body, View::ap, 2);
  const RadiographTarget base = target_segment(*model, body, View::ap, 0);
  EXPECT_GT((tip.centre - base.centre).norm(), 100);
  EXPECT_LT(tip.behind_mm + tip.before_mm, whole.behind_mm + whole.before_mm);
  const RadiographTarget point = target_point(*model, body, View::pa, {1, 2, 3});
  EXPECT_EQ(point.centre, Vector3d(1, 2, 3));
  EXPECT_NEAR(point.behind_mm, 2 - low.y(), 1e-3);
}

TEST(SetupTest, MovesWithABody) {
  const XRaySetup setup = positioned(View::lateral_right, {Vector3d(1, 2, 3), 10, 20}, 900, 100, {});
  const RigidTransform motion{Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5), Vector3d(100, -20, 7)};
  const XRaySetup moved = setup.moved(motion);
  check(moved);
  EXPECT_NEAR((moved.detector.point(3, 4) - motion * setup.detector.point(3, 4)).norm(), 0, 1e-9);
  EXPECT_NEAR((moved.source - motion * setup.source).norm(), 0, 1e-9);
}

}  // namespace
}  // namespace ecorche::runtime
