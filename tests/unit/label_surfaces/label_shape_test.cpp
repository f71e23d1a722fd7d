// SPDX-License-Identifier: Apache-2.0
// What a nameless label is by its length, and where arms may be that do not lie where they were looked for.
#include <gtest/gtest.h>

#include "preprocess/scan/label_shape.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::scan {
namespace {

// Points every 5 mm along x, three by three beside each other.
Points rod(double length, const Eigen::Vector3d& from = Eigen::Vector3d::Zero()) {
  std::vector<Eigen::Vector3d> all;
  for (int step = 0; 5 * step <= length; ++step) {
    for (const double y : {-10, 0, 10})
      for (const double z : {-10, 0, 10}) all.push_back(from + Eigen::Vector3d(5 * step, y, z));
  }
  Points out(static_cast<Eigen::Index>(all.size()), 3);
  for (std::size_t p = 0; p < all.size(); ++p) out.row(static_cast<Eigen::Index>(p)) = all[p];
  return out;
}

NamelessLabel label_of(Points points) {
  NamelessLabel label;
  label.points = std::move(points);
  return label;
}

TEST(LabelShape, ExtentsAreThoseOfPrincipalAxes) {
  const Extents of = extents_of(rod(300));
  EXPECT_NEAR(of.length, 300, 1e-6);
  EXPECT_NEAR(of.width, 20, 1e-6);
}

TEST(LabelShape, ALongBoneIsNoVertebra) {
  BodyTemplate body;
  body.segments.resize(1);
  body.bones = {{"humerus_left", 0, rod(300), 0}, {"vertebra", 0, rod(30), 0}};
  ImageGrid grid;
  grid.size = {1000, 200, 200};
  grid.origin = {-500, -100, -100};
  const std::vector<NamelessLabel> labels{label_of(rod(50)), label_of(rod(150)),
                                          label_of(rod(50, {-500, 0, 0}))};
  const TooShort too_short(body, labels, grid);
  EXPECT_TRUE(too_short(0, 0, 1));
  EXPECT_FALSE(too_short(0, 0, 0.4));  // of a child
  EXPECT_FALSE(too_short(0, 1, 1));
  EXPECT_FALSE(too_short(1, 0, 1));  // half of it
  EXPECT_FALSE(too_short(2, 0, 1));  // the rest lies beyond the field of view
}

TEST(Views, ArmsAreHeldTheOtherWayOnTheSameTrunk) {
  BodyTemplate body;
  body.segments = {{"thorax", -1, {0, 0, 1200}},
                   {"girdle_left", 0, {20, 0, 1400}},
                   {"upper_arm_left", 1, {180, 0, 1400}},
                   {"forearm_left", 2, {200, 0, 1100}}};
  body.bones = {{"humerus_left", 2, rod(300, {180, 0, 1250}), 0}};
  Similarity place;
  place.shift = {5, 6, 7};
  Placed raised = laid(body, place, View::arms_up);
  raised.segments[1].shift.x() += 3;  // fitted
  const Placed hanging = with_other_arms(body, raised);
  EXPECT_EQ(hanging.view, View::body);
  const Eigen::Vector3d elbow(200, 0, 1100);
  EXPECT_LT((hanging.segments[3](elbow) - (elbow + Eigen::Vector3d(8, 6, 7))).norm(), 1e-9);
  EXPECT_GT(raised.segments[3](elbow).z(), 1600);
  EXPECT_LT((hanging.segments[0](elbow) - raised.segments[0](elbow)).norm(), 1e-9);
  const Placed again = with_other_arms(body, hanging);
  EXPECT_LT((again.segments[3](elbow) - raised.segments[3](elbow) - Eigen::Vector3d(3, 0, 0)).norm(), 1e-9);
  ImageGrid grid;
  grid.size = {1000, 200, 1500};
  grid.origin = {-500, -100, 0};
  EXPECT_TRUE(upper_arm_in_view(body, hanging, grid));
  EXPECT_FALSE(upper_arm_in_view(body, raised, grid));
}

}  // namespace
}  // namespace ecorche::scan
