// SPDX-License-Identifier: Apache-2.0
// How deep bones run into each other, quickly, against the slow way and against balls, of which one knows.
#include "runtime/quality/overlap_meter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "runtime/quality/bone_overlaps.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

constexpr double kRadius = 20;

// A closed ellipsoid of rings about z.
Tissue ellipsoid(const Vector3d& middle, const Vector3d& half_axes, std::int32_t segment) {
  constexpr int rings = 40, around = 80;
  Tissue out;
  out.name = "bone " + std::to_string(segment);
  out.segment = segment;
  out.V.resize(2 + (rings - 1) * around, 3);
  const auto put = [&](Eigen::Index row, const Vector3d& unit) {
    out.V.row(row) = (middle + half_axes.cwiseProduct(unit)).cast<float>().transpose();
  };
  put(0, Vector3d::UnitZ());
  put(1, -Vector3d::UnitZ());
  const auto at = [](int ring, int step) { return 2 + (ring - 1) * around + step % around; };
  for (int r = 1; r < rings; ++r) {
    for (int s = 0; s < around; ++s) {
      const double down = std::numbers::pi * r / rings, turn = 2 * std::numbers::pi * s / around;
      put(at(r, s), {std::sin(down) * std::cos(turn), std::sin(down) * std::sin(turn), std::cos(down)});
    }
  }
  std::vector<Eigen::RowVector3i> faces;
  for (int s = 0; s < around; ++s) {
    faces.emplace_back(0, at(1, s), at(1, s + 1));
    faces.emplace_back(1, at(rings - 1, s + 1), at(rings - 1, s));
    for (int r = 1; r + 1 < rings; ++r) {
      faces.emplace_back(at(r, s), at(r + 1, s), at(r + 1, s + 1));
      faces.emplace_back(at(r, s), at(r + 1, s + 1), at(r, s + 1));
    }
  }
  out.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) out.F.row(static_cast<Eigen::Index>(f)) = faces[f];
  return out;
}

// The second hangs on the first, by a joint midway.
Model two_bones(const Vector3d& second, const Vector3d& half_axes) {
  Model model;
  model.tissues = {ellipsoid(Vector3d::Zero(), half_axes, 0), ellipsoid(second, half_axes, 1)};
  model.rig.skeleton.segments.resize(2);
  model.rig.skeleton.segments[1].parent = 0;
  model.rig.skeleton.segments[1].joint.center = second / 2;
  return model;
}

// The second turned about `center`.
std::vector<RigidTransform> turned(const Vector3d& center, const Vector3d& axis, double radians) {
  RigidTransform motion;
  motion.q = Eigen::AngleAxisd(radians, axis.normalized());
  motion.t = center - motion.q * center;
  return {RigidTransform{}, motion};
}

TEST(DepthGrid, IsThatOfABall) {
  const Tissue ball = ellipsoid({3, -2, 5}, Vector3d::Constant(kRadius), 0);
  const SurfaceTrees trees(SurfaceMesh{ball.V.cast<double>(), ball.F});
  const Eigen::AlignedBox3d box(Vector3d(-10, -25, -10), Vector3d(24, 20, 30));
  constexpr double spacing = 2.5;
  const DepthGrid grid(trees, box, spacing);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  int inside = 0;
  for (int k = 0; k < 5000; ++k) {
    const Vector3d p =
        box.min() + box.sizes().cwiseProduct(Vector3d(unit(random), unit(random), unit(random)));
    const double from_middle = (p - Vector3d(3, -2, 5)).norm(), asked = std::max(0.0, kRadius - from_middle);
    // The bound of its docstring, and what the ball's facets cut off.
    const double bound = spacing * spacing / 4 / from_middle + 0.07;
    // In the middle the nearest point jumps.
    EXPECT_NEAR(grid.depth(p.cast<float>()), asked, from_middle > 2 * spacing ? bound : spacing)
        << p.transpose();
    EXPECT_GE(grid.most(p.cast<float>()), kRadius - from_middle - 0.01) << p.transpose();
    inside += static_cast<int>(asked > 1);
  }
  EXPECT_GT(inside, 1000);
  EXPECT_EQ(grid.depth({-14, 0, 0}), 0) << "in the ball, but not in the box";
  EXPECT_EQ(grid.depth({1e9F, 0, 0}), 0);
  EXPECT_EQ(grid.depth({std::nanf(""), 0, 0}), 0);
}

TEST(OverlapMeter, OfBallsIsWhatTheirMiddlesSay) {
  const Vector3d second(0, 0, 2 * kRadius + 1);
  const Model model = two_bones(second, Vector3d::Constant(kRadius));
  const OverlapMeter meter(model);
  for (const double degrees : {0.0, 10.0, 30.0, 50.0, 60.0, 75.0, 90.0}) {
    const double radians = degrees * std::numbers::pi / 180;
    const BoneOverlap found = meter.deepest(turned(second / 2, Vector3d::UnitX(), radians));
    const double asked = std::max(0.0, 2 * kRadius - second.z() * std::cos(radians / 2));
    EXPECT_NEAR(found.mm, asked, 0.5) << degrees;
    if (asked > 0.5) {
      EXPECT_NE(found.bone, found.into);
    }
  }
}

TEST(OverlapMeter, SaysWhatTheSlowWaySays) {
  const Vector3d half_axes(20, 24, 30);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  int deep = 0;
  for (const double apart : {61.0, 60.0, 58.0}) {  // apart at rest, touching, 2 mm into each other
    const Model model = two_bones({0, 0, apart}, half_axes);
    const OverlapMeter meter(model);
    BoneOverlaps slow(model);
    for (int k = 0; k < 40; ++k) {
      const Vector3d center = Vector3d(4 * unit(random), 4 * unit(random), apart / 2 - 4 + 4 * unit(random));
      const auto segments =
          turned(center, {unit(random), unit(random), 0.2 * unit(random)}, 1.2 * unit(random));
      const BoneOverlap found = meter.deepest(segments), asked = slow.deepest(segments);
      EXPECT_NEAR(found.mm, asked.mm, 0.5) << apart << ' ' << k;
      deep += static_cast<int>(asked.mm > 5);
    }
  }
  EXPECT_GT(deep, 10);
}

// As BoneOverlaps says it, asking for every vertex.
double by_every_vertex(const Model& model, const std::vector<RigidTransform>& segments) {
  double deepest = 0;
  for (const std::size_t of : {0U, 1U}) {
    const Tissue& in = model.tissues[1 - of];
    const SurfaceTrees trees(SurfaceMesh{in.V.cast<double>(), in.F});
    const RigidTransform motion = segments[1 - of].inverse() * segments[of];
    std::vector<double> rest, now;
    for (Eigen::Index v = 0; v < model.tissues[of].V.rows(); ++v) {
      const Vector3d p = model.tissues[of].V.row(v).cast<double>().transpose();
      rest.push_back(trees.depth(p));
      now.push_back(trees.depth(motion * p));
    }
    const double touching = std::min(kTouchingMm, *std::max_element(rest.begin(), rest.end()));
    for (std::size_t v = 0; v < rest.size(); ++v)
      deepest = std::max(deepest, now[v] - std::max(touching, rest[v]));
  }
  return deepest;
}

TEST(BoneOverlaps, LeavesOutOnlyWhatCannotLieDeeper) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const double apart : {61.0, 58.0, 52.0}) {
    const Model model = two_bones({0, 0, apart}, {12, 16, 30});
    BoneOverlaps overlaps(model);
    for (int k = 0; k < 8; ++k) {
      const auto segments = turned({4 * unit(random), 4 * unit(random), apart / 2 - 4},
                                   {unit(random), unit(random), 0.2 * unit(random)}, unit(random));
      const double asked = by_every_vertex(model, segments);
      EXPECT_NEAR(overlaps.deepest(segments).mm, asked, 1e-9) << apart << ' ' << k;
      EXPECT_TRUE(asked == 0 || overlaps.meet(segments, 0.9 * asked));
      EXPECT_FALSE(overlaps.meet(segments, 1.1 * asked + 0.01));
    }
  }
}

TEST(OverlapMeter, WaitsForNothingWhereThatIsAsked) {
  const Vector3d second(0, 0, 2 * kRadius + 1);
  const Model model = two_bones(second, Vector3d::Constant(kRadius));
  const OverlapMeter meter(model);
  const auto bent = turned(second / 2, Vector3d::UnitX(), 1);
  EXPECT_TRUE(meter.deepest_if_prepared(turned(second / 2, Vector3d::UnitX(), 0))) << "nothing is asked";
  EXPECT_FALSE(meter.deepest_if_prepared(bent));
  meter.prepare(0);
  EXPECT_FALSE(meter.deepest_if_prepared(bent)) << "half of it";
  meter.prepare(1);
  const std::optional<BoneOverlap> found = meter.deepest_if_prepared(bent);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->mm, meter.deepest(bent).mm);
  EXPECT_GT(found->mm, 1);
}

TEST(OverlapMeter, BonesThatMoveAlikeNeverMeet) {
  Model model = two_bones({0, 0, 30}, Vector3d::Constant(kRadius));
  const RigidTransform motion = turned({1, 2, 3}, {1, 2, 0}, 1)[1];
  EXPECT_EQ(OverlapMeter(model).deepest(std::vector{motion, motion}).mm, 0);
  model.tissues[1].segment = 0;
  EXPECT_EQ(OverlapMeter(model).deepest(turned({0, 0, 15}, Vector3d::UnitX(), 1)).mm, 0);
}

TEST(OverlapMeter, NeedsNoBones) {
  EXPECT_EQ(OverlapMeter(Model{}).deepest({}).mm, 0);
}

}  // namespace
}  // namespace ecorche::runtime
