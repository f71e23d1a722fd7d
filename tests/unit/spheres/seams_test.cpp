// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/seams.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/spheres/coverage.hpp"
#include "runtime/spheres/owners.hpp"
#include "runtime/spheres/tears.hpp"
#include "tests/unit/spheres/bent_cylinder.hpp"

namespace ecorche::runtime {
namespace {

using test::BentCylinder;

Vec3 bend_of(const BentCylinder& body) {
  return body.skeleton.grid.point(BentCylinder::radius + 2, BentCylinder::radius + 2, BentCylinder::bend);
}

Segment segment(const std::string& name, int parent, const Vec3& centre) {
  Segment out;
  out.name = name;
  out.parent = parent;
  out.joint.center = {centre[0], centre[1], centre[2]};
  return out;
}

struct BentSeams {
  BallSet rest, posed;
  Seams seams;

  BentSeams(const BentCylinder& body, const VolumetricSkeleton& skeleton, const Skeleton& rig,
            const std::vector<RigidTransform>& motions)
      : rest(balls_at_rest(skeleton, body.skeleton.grid)), posed(rest) {
    seams = seams_of(rest, skeleton.segment, rig);
    move_balls(skeleton, motions, posed);
    bridge(seams, motions, posed);
  }
};

Skeleton two(const BentCylinder& body) {
  Skeleton rig;
  rig.segments = {segment("low", -1, {0, 0, 0}), segment("high", 0, bend_of(body))};
  return rig;
}

TEST(Seams, NothingIsAddedWhereNothingTurns) {
  const BentCylinder body(0.3);
  const BentSeams still(body, body.skeleton, two(body), body.bent(0));
  EXPECT_EQ(still.posed.balls.size(), still.rest.balls.size());
  ASSERT_EQ(still.seams.seams.size(), 1U);
  EXPECT_EQ(still.seams.seams[0].way, (std::vector<std::int32_t>{0, 1}));
}

// The sheet is the cross-section at the bend: its balls fill that disc, and none leaves the body.
TEST(Seams, TheSheetHoldsTheVoxelsOnBothSides) {
  const BentCylinder body(0.3);
  const BentSeams still(body, body.skeleton, two(body), body.bent(0));
  const auto owner = owners_of(still.rest, {{0, 0, 0}, body.skeleton.grid.size});
  const auto segment_of = [&](std::int32_t ball) {
    return body.skeleton.segment[static_cast<std::size_t>(ball)];
  };
  const ImageGrid& grid = body.skeleton.grid;
  std::size_t beside = 0, far = 0;
  for (int k = 0; k + 1 < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const std::int32_t here = owner[grid.offset(i, j, k)], above = owner[grid.offset(i, j, k + 1)];
        if (here < 0 || above < 0 || segment_of(here) == segment_of(above)) continue;
        ++beside;
        double least = 1e9;  // to the rim of a ball of the sheet, negative within
        for (const Seam::Sheet& at : still.seams.seams[0].sheet) {
          least = std::min(
              least, std::hypot(i - at.voxel[0], j - at.voxel[1], k - at.voxel[2]) - std::sqrt(at.radius2));
        }
        far += least >= 0.51;  // balls that stick out by less than half a voxel are left out
      }
    }
  }
  EXPECT_GT(beside, 100U);
  EXPECT_EQ(far, 0U);
  for (const Seam::Sheet& at : still.seams.seams[0].sheet) {
    const double away =
        std::hypot(at.voxel[0] - BentCylinder::radius - 2, at.voxel[1] - BentCylinder::radius - 2);
    EXPECT_LE(away + std::sqrt(at.radius2), BentCylinder::radius + 1 + 1e-9);
  }
}

// The slow twin of how a sheet is swept: the ways of all its balls in small steps, every one from the arc to
// its chord. `angle` about the axis x through `hinge`, voxels. Within half a voxel of its balls?
struct Swept {
  std::vector<Seam::Sheet> balls;

  Swept(const std::vector<Seam::Sheet>& sheet, const Vec3& hinge, double angle) {
    for (const Seam::Sheet& at : sheet) {
      const auto turned = [&](double by) {
        const double y = at.voxel[1] - hinge[1], z = at.voxel[2] - hinge[2];
        return Vec3{at.voxel[0], hinge[1] + std::cos(by) * y - std::sin(by) * z,
                    hinge[2] + std::sin(by) * y + std::cos(by) * z};
      };
      const Vec3 to = turned(angle);
      for (int i = 0; i <= 60; ++i) {
        const Vec3 arc = turned(angle * i / 60);
        for (int c = 0; c <= 12; ++c) {
          Seam::Sheet ball = at;
          for (std::size_t a = 0; a < 3; ++a) {
            const double chord = at.voxel[a] + (to[a] - at.voxel[a]) * i / 60;
            ball.voxel[a] = arc[a] + (chord - arc[a]) * c / 12;
          }
          balls.push_back(ball);
        }
      }
    }
  }

  bool holds(int i, int j, int k) const {
    return std::any_of(balls.begin(), balls.end(), [&](const Seam::Sheet& ball) {
      return std::hypot(i - ball.voxel[0], j - ball.voxel[1], k - ball.voxel[2]) <
             std::sqrt(ball.radius2) + 0.5;
    });
  }
};

// Turned about its rim, as a hip turns behind the middle of the body: the cross-section sweeps a wedge, and
// what bridges add is that wedge; and from 125 degrees, where balls at its sides go a straight way too, some
// voxels between that and their arcs.
TEST(Seams, BridgesFillWhatTheCrossSectionSweepsAndNoMore) {
  const BentCylinder body(0.3);
  constexpr int middle = BentCylinder::radius + 2, rim = 2;
  const Vec3 hinge = body.skeleton.grid.point(middle, rim, BentCylinder::bend);
  Skeleton rig = two(body);
  rig.segments[1].joint.center = {hinge[0], hinge[1], hinge[2]};
  for (const double degrees : {75.0, 100.0, 125.0, 150.0}) {
    const double angle = degrees * std::numbers::pi / 180;
    const Eigen::Vector3d c(hinge.data());
    const Eigen::Quaterniond q(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()));
    const BentSeams bent(body, body.skeleton, rig, {{}, {q, c - q * c}});
    const Swept swept(bent.seams.seams[0].sheet, {middle, rim, BentCylinder::bend}, angle);
    BallSet without = bent.posed;
    without.balls.resize(bent.rest.balls.size());
    const LatticeBox box = grown_box(bent.posed);
    const ImageGrid grid = grid_of(bent.posed.lattice, box);
    const Image with = covered(bent.posed, box), plain = covered(without, box);
    std::size_t wedge = 0, gap_with = 0, gap_without = 0, beyond = 0, beyond_all = 0;
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) {
          const double x = i + box.first[0] - middle, y = j + box.first[1] - rim,
                       z = k + box.first[2] - BentCylinder::bend;
          const std::size_t v = grid.offset(i, j, k);
          const bool held = with.scalars<std::uint8_t>()[v] != 0,
                     held_plain = plain.scalars<std::uint8_t>()[v] != 0;
          // Turned back into the cross-section: how far from its middle?
          const double away = std::hypot(x, std::hypot(y, z) - BentCylinder::radius),
                       turned = std::atan2(z, y);
          if (turned >= 0 && turned <= angle && away <= BentCylinder::radius - 1) {
            ++wedge;
            gap_with += !held;
            gap_without += !held_plain;
          }
          if (!held || held_plain || away <= BentCylinder::radius + 1) continue;
          ++beyond;
          beyond_all += !swept.holds(i + box.first[0], j + box.first[1], k + box.first[2]);
        }
      }
    }
    EXPECT_GT(wedge, 500U) << degrees;
    EXPECT_GT(gap_without, wedge / 20) << degrees;
    EXPECT_EQ(gap_with, 0U) << degrees;
    EXPECT_LE(beyond, degrees > 100 ? wedge / 25 : 0) << degrees;
    EXPECT_EQ(beyond_all, 0U) << degrees;
  }
}

// Turned about an axis well outside it, as flesh of the armpit turns about the shoulder: the arcs alone would
// be a hollow shell.
TEST(Seams, ASheetFarFromTheAxisIsBridgedStraightToo) {
  const BentCylinder body(0.3);
  constexpr int middle = BentCylinder::radius + 2, out = -2 * BentCylinder::radius;
  const Vec3 hinge = body.skeleton.grid.point(middle, out, BentCylinder::bend);
  Skeleton rig = two(body);
  rig.segments[1].joint.center = {hinge[0], hinge[1], hinge[2]};
  const Eigen::Vector3d c(hinge.data());
  const double angle = 110 * std::numbers::pi / 180;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()));
  const BentSeams bent(body, body.skeleton, rig, {{}, {q, c - q * c}});
  const TearDetector detector(bent.rest, body.skeleton.segment);
  EXPECT_FALSE(detector.look(bent.posed).errs());
  const Swept swept(bent.seams.seams[0].sheet, {middle, out, BentCylinder::bend}, angle);
  BallSet without = bent.posed;
  without.balls.resize(bent.rest.balls.size());
  EXPECT_TRUE(detector.look(without).errs());
  const LatticeBox box = grown_box(bent.posed);
  const ImageGrid grid = grid_of(bent.posed.lattice, box);
  const Image with = covered(bent.posed, box), plain = covered(without, box);
  std::size_t added = 0, beyond = 0;
  for (int k = 0; k < grid.size[2]; k += 2) {
    for (int j = 0; j < grid.size[1]; j += 2) {
      for (int i = 0; i < grid.size[0]; i += 2) {
        const std::size_t v = grid.offset(i, j, k);
        if (with.scalars<std::uint8_t>()[v] == 0 || plain.scalars<std::uint8_t>()[v] != 0) continue;
        ++added;
        beyond += !swept.holds(i + box.first[0], j + box.first[1], k + box.first[2]);
      }
    }
  }
  EXPECT_GT(added, 500U);
  EXPECT_EQ(beyond, 0U);
}

// Flesh of two segments with a third between them, as at the armpit.
TEST(Seams, SegmentsTwoJointsApartAreBridgedNearTheJoints) {
  const BentCylinder body(0.3);
  VolumetricSkeleton skeleton = body.skeleton;
  for (std::int32_t& s : skeleton.segment) s *= 2;
  Skeleton rig;
  rig.segments = {segment("trunk", -1, {0, 0, 0}), segment("girdle", 0, bend_of(body)),
                  segment("arm", 1, bend_of(body))};
  const std::vector<RigidTransform> motions{{}, body.bent(60)[1], body.bent(120)[1]};
  const BentSeams bent(body, skeleton, rig, motions);
  ASSERT_EQ(bent.seams.seams.size(), 1U);
  EXPECT_EQ(bent.seams.seams[0].way, (std::vector<std::int32_t>{0, 1, 2}));
  EXPECT_FALSE(TearDetector(bent.rest, skeleton.segment).look(bent.posed).errs());

  // The same far from both joints: what touches there parts for good.
  const auto far = body.skeleton.grid.point(BentCylinder::radius + 2, BentCylinder::radius + 2, 2);
  rig.segments[1].joint.center = rig.segments[2].joint.center = {far[0], far[1], far[2]};
  EXPECT_TRUE(BentSeams(body, skeleton, rig, motions).seams.seams.empty());

  // And three joints apart they are strangers.
  rig.segments.push_back(segment("hand", 2, bend_of(body)));
  for (std::int32_t& s : skeleton.segment) s = s == 2 ? 3 : 0;
  EXPECT_TRUE(seams_of(bent.rest, skeleton.segment, rig).seams.empty());
}

// Siblings: the way between them leads over their parent.
TEST(Seams, TheWayBetweenSiblingsLeadsOverTheirParent) {
  const BentCylinder body(0.3);
  VolumetricSkeleton skeleton = body.skeleton;
  for (std::int32_t& s : skeleton.segment) s += 1;
  Skeleton rig;
  rig.segments = {segment("pelvis", -1, {0, 0, 0}), segment("left", 0, bend_of(body)),
                  segment("right", 0, bend_of(body))};
  const Seams seams = seams_of(balls_at_rest(skeleton, body.skeleton.grid), skeleton.segment, rig);
  ASSERT_EQ(seams.seams.size(), 1U);
  EXPECT_EQ(seams.seams[0].way, (std::vector<std::int32_t>{1, 0, 2}));
}

}  // namespace
}  // namespace ecorche::runtime
