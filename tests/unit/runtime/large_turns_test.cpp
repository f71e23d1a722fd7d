// SPDX-License-Identifier: Apache-2.0
// Joints that turn by half a turn and more.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/runtime/largest_step.hpp"
#include "tests/unit/runtime/loose_toys.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;
using std::numbers::pi;

// Largest growth of any edge of the tets: a tear would stretch edges across it to the size of the body.
double largest_stretch(const Model& model, const std::vector<float>& nodes) {
  double worst = 0;
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    for (int a = 0; a < 4; ++a) {
      for (int b = a + 1; b < 4; ++b) {
        const int i = model.tets(t, a), j = model.tets(t, b);
        Vector3d posed;
        for (int c = 0; c < 3; ++c) {
          posed[c] = static_cast<double>(nodes[static_cast<std::size_t>(3 * i + c)]) -
                     static_cast<double>(nodes[static_cast<std::size_t>(3 * j + c)]);
        }
        const double rest = (model.nodes.row(i) - model.nodes.row(j)).cast<double>().norm();
        worst = std::max(worst, posed.norm() / rest);
      }
    }
  }
  return worst;
}

// One joint swept through more than a whole turn, two degrees at a time. In every frame neighbours stay
// together. From frame to frame everything moves by little, but for one moment: at exactly 180 degrees the
// way round that is shorter changes sides, and what blends two segments by quaternions changes with it. A
// pose tells a rotation and no history, so no rule could go on: at 180 degrees both ways are equally good,
// and the same pose must give the same body. LBS has no way round and never jumps.
TEST(BodyPoser, AJointTurnedThroughAWholeTurnTearsNothing) {
  const auto model = shared(loose_toy());
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  for (const Vector3d& axis : {Vector3d(0, 0, 1), Vector3d(1, 0, 0), Vector3d(0.3, 0.4, 0.5)}) {
    for (const Skinning skinning : kAll) {
      std::vector<float> before;
      double stretch_within = 0;
      for (int degree = 0; degree <= 400; degree += 2) {
        Pose pose = Pose::rest(3);
        pose.rotation[1] = AngleAxisd(degree * pi / 180, axis.normalized());
        ASSERT_TRUE(poser.run(pose, skinning, {}, body).ok());
        const double stretch = largest_stretch(*model, body.nodes);
        if (degree <= 180) stretch_within = std::max(stretch_within, stretch);
        EXPECT_LE(stretch, 1.001 * stretch_within + 0.05) << degree << " deg, " << skinning_name(skinning);
        // 2 degrees at 300 mm are 10 mm.
        const bool changes_sides = degree == 182 && skinning != Skinning::lbs;
        if (!before.empty() && !changes_sides) {
          EXPECT_LT(largest_step(before, body.nodes), 24) << degree;
        }
        before = body.nodes;
      }
      EXPECT_LT(stretch_within, 5) << skinning_name(skinning);
    }
  }
}

// Two joints of 150 degrees about one axis make 300 degrees between base and tip: the shortest way from base
// to tip is the other way round, and only the tree knows better. Where three segments blend, a pivot per node
// would tear.
TEST(BodyPoser, JointsThatAddUpBeyondHalfATurnTearNothing) {
  const auto model = shared(wide_toy());
  const BodyPoser poser(model);
  PosedBody body = poser.make_frame();
  for (int degree = 0; degree <= 175; degree += 5) {
    Pose pose = Pose::rest(3);
    pose.rotation[1] = pose.rotation[2] = AngleAxisd(degree * pi / 180, Vector3d::UnitZ());
    for (const Skinning skinning : kAll) {
      ASSERT_TRUE(poser.run(pose, skinning, {}, body).ok());
      EXPECT_LT(largest_stretch(*model, body.nodes), 2.5) << degree << " deg, " << skinning_name(skinning);
    }
  }
}

TEST(BodyPoser, AWholeTurnApartStaysFinite) {
  const BodyPoser poser(shared(loose_toy()));
  PosedBody body = poser.make_frame();
  Pose pose = Pose::rest(3);
  pose.rotation[1] = AngleAxisd(pi, Vector3d::UnitX());
  pose.rotation[2] = AngleAxisd(pi, Vector3d::UnitX());
  for (const Skinning skinning : kAll) {
    ASSERT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body).ok());
    for (const float x : body.nodes) ASSERT_TRUE(std::isfinite(x));
  }
}

}  // namespace
}  // namespace ecorche::runtime
