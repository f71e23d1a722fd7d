// SPDX-License-Identifier: Apache-2.0
// Joints that slide along a limb to where both bones fit, and bones that touch parted at their joint.
#include <gtest/gtest.h>

#include <cmath>

#include "preprocess/scan/fit_segments.hpp"
#include "preprocess/scan/part_joints.hpp"
#include "preprocess/scan/slide_joints.hpp"

namespace ecorche::scan {
namespace {

// Of a long bone along z from `low` to `high`: a thin shaft with thick ends of 30 mm, the upper one narrower.
Points long_bone(double low, double high) {
  std::vector<Eigen::Vector3d> all;
  for (int n = 0; low + 2 + 5 * n < high; ++n) {
    const double z = low + 2 + 5 * n;
    const double r = z - low < 30 ? 26 : high - z < 30 ? 20 : 8;
    for (int a = 0; a < 10; ++a) all.emplace_back(r * std::cos(0.63 * a), r * std::sin(0.63 * a), z);
  }
  Points out(static_cast<Eigen::Index>(all.size()), 3);
  for (std::size_t p = 0; p < all.size(); ++p) out.row(static_cast<Eigen::Index>(p)) = all[p].transpose();
  return out;
}

constexpr double kKnee = -300, kSole = -600;

// A thigh above a shank, the hip at 0.
BodyTemplate limb_template() {
  BodyTemplate out;
  out.segments = {{"thigh_left", -1, {0, 0, 0}}, {"shank_left", 0, {0, 0, kKnee}}};
  out.bones = {{"femur_left", 0, long_bone(kKnee + 2, 0), 0},
               {"tibia_left", 1, long_bone(kSole, kKnee - 2), 0}};
  return out;
}

// Where the two segments have their joint after sliding, along z, in a body with its knee at `knee`: its
// thigh is longer and its shank shorter than the template's, or the other way.
double slid_knee(double knee) {
  const BodyTemplate limb = limb_template();
  const Points &femur = limb.bones[0].points, &tibia = limb.bones[1].points;
  const Eigen::RowVector3d sole(0, 0, kSole);
  Points bone(femur.rows() + tibia.rows(), 3);
  bone.topRows(femur.rows()) = femur * (knee / kKnee);
  bone.bottomRows(tibia.rows()) =
      ((tibia.rowwise() - sole) * ((knee - kSole) / (kKnee - kSole))).rowwise() + sole;
  ImageGrid grid;
  grid.size = {120, 120, 700};
  grid.spacing = {1, 1, 1};
  grid.origin = {-60, -60, -650};
  std::vector<Similarity> placed(2);
  slide_joints(limb, segment_clouds(limb, {1, 1}), bone, grid, 1, placed, {});
  const Eigen::Vector3d joint = limb.segments[1].joint;
  const Eigen::Vector3d of_thigh = placed[0](joint), of_shank = placed[1](joint);
  EXPECT_LT((of_thigh - of_shank).norm(), 5);
  EXPECT_LT(placed[0]({0, 0, 0}).norm(), 5) << "the hip stays";
  EXPECT_LT((placed[1]({0, 0, kSole}) - Eigen::Vector3d(0, 0, kSole)).norm(), 5) << "and the ankle";
  return (of_thigh[2] + of_shank[2]) / 2;
}

TEST(SlideJoints, AJointGoesToWhereBothBonesFit) {
  EXPECT_NEAR(slid_knee(kKnee - 25), kKnee - 25, 4);
  EXPECT_NEAR(slid_knee(kKnee + 25), kKnee + 25, 4);
}

TEST(SlideJoints, AJointStaysWhereNothingIsToGain) {
  EXPECT_NEAR(slid_knee(kKnee), kKnee, 1e-9);
}

// Two square bars of 20 mm that touch in a neck of 6 mm at the knee; what is labelled thigh ends `off`
// beyond.
TEST(PartJoints, BonesThatTouchArePartedAtTheNeck) {
  for (const double off : {-8.0, 8.0}) {
    const BodyTemplate limb = limb_template();
    ImageGrid grid;
    grid.size = {24, 24, 300};
    grid.spacing = {2, 2, 2};
    grid.origin = {-23, -23, -599};
    std::vector<std::uint16_t> of(grid.voxels(), 0);
    const auto each = [&](auto&& f) {
      for (int k = 0; k < grid.size[2]; ++k) {
        for (int j = 0; j < grid.size[1]; ++j) {
          for (int i = 0; i < grid.size[0]; ++i) {
            const auto p = grid.point(i, j, k);
            f(grid.offset(i, j, k), std::max(std::abs(p[0]), std::abs(p[1])), p[2] - kKnee);
          }
        }
      }
    };
    each([&](std::size_t v, double across, double up) {
      if (across < (std::abs(up) < 4 ? 3 : 20)) of[v] = up > off ? 1 : 2;
    });
    Placed placed;
    placed.segments.resize(2);
    placed.in_play = {1, 1};
    part_joints(limb, segment_clouds(limb, placed.in_play), placed, grid, of, {});
    std::size_t wrong = 0;
    each([&](std::size_t v, double, double up) {
      if (of[v] != 0 && std::abs(up) > 4) wrong += of[v] == (up > 0 ? 1 : 2) ? 0 : 1;
    });
    EXPECT_EQ(wrong, 0U) << off;
  }
}

}  // namespace
}  // namespace ecorche::scan
