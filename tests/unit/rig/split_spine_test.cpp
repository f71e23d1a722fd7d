// SPDX-License-Identifier: Apache-2.0
// Joints of a spine by vertebra, on drums that stand along a curve.
#include <gtest/gtest.h>

#include <numbers>

#include "core/values/degrees.hpp"
#include "core/values/spine.hpp"
#include "tests/unit/rig/human_bodies.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Vector3d;

constexpr double kHalf = 9, kGap = 4, kRadius = 18;  // mm

// A closed cylinder about `up`, its end plates with rings of vertices.
SurfaceMesh drum(const Vector3d& middle, const Vector3d& up) {
  constexpr int kRound = 24, kRings = 4;
  const Vector3d side = up.cross(Vector3d::UnitX()).normalized(), across = side.cross(up);
  SurfaceMesh out;
  out.V.resize(2 * (1 + kRings * kRound), 3);
  std::vector<std::array<int, 3>> faces;
  for (const int end : {0, 1}) {
    const int first = end * (1 + kRings * kRound);
    const auto at = [&](int ring, int k) {
      return ring == 0 ? first : first + 1 + (ring - 1) * kRound + (k % kRound);
    };
    const Vector3d plate = middle + (end == 0 ? -kHalf : kHalf) * up;
    out.V.row(first) = plate;
    for (int ring = 1; ring <= kRings; ++ring) {
      for (int k = 0; k < kRound; ++k) {
        const double angle = 2 * std::numbers::pi * k / kRound, r = kRadius * ring / kRings;
        out.V.row(at(ring, k)) = plate + r * (std::cos(angle) * across + std::sin(angle) * side);
        const std::array<int, 3> a{at(ring - 1, k), at(ring, k), at(ring, k + 1)};
        const std::array<int, 3> b{at(ring - 1, k), at(ring, k + 1), at(ring - 1, k + 1)};
        for (const auto& f : {a, b}) {
          if (f[0] == f[2] || f[1] == f[2]) continue;
          faces.push_back(end == 1 ? f : std::array<int, 3>{f[0], f[2], f[1]});
        }
      }
    }
  }
  const int low = 1 + (kRings - 1) * kRound, high = low + 1 + kRings * kRound;
  for (int k = 0; k < kRound; ++k) {
    const int n = (k + 1) % kRound;
    faces.push_back({low + k, low + n, high + n});
    faces.push_back({low + k, high + n, high + k});
  }
  out.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f)
    out.F.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  return out;
}

// Where the disc below a level lies, counted from L5, and the spine's direction there: a slow bend forward.
struct Place {
  Vector3d at, up;
};
Place place(double level) {
  constexpr double kStep = 2 * kHalf + kGap, kBend = 1200;  // mm, radius
  const double angle = kStep * level / kBend;
  return {Vector3d(0, -kBend * (1 - std::cos(angle)), 940 + kBend * std::sin(angle)),
          Vector3d(0, -std::sin(angle), std::cos(angle))};
}

Case drums(spine::Ribs ribs, const std::set<std::string>& without = {}) {
  Case patient = test::human_case(test::phantom_bones({"pelvis", "thigh_left"}, 4));
  patient.whole_spine = std::make_shared<Skeleton>(patient.skeleton);
  patient.ribs_apart = ribs == spine::Ribs::vertebrae;
  std::set<std::string> all{"thorax"};
  double level = 0;
  for (const spine::Level& one : spine::levels()) {
    const std::string name(one.segment);
    all.insert(name);
    const Place here = place(level + 0.5);
    if (!without.contains(name)) patient.bones.push_back({name, name, drum(here.at, here.up)});
    ++level;
  }
  patient.skeleton = spine::split(*patient.whole_spine, all, ribs);
  return patient;
}

TEST(SplitSpine, JointsLieAmidTheDiscs) {
  const test::Found body = test::found(drums(spine::Ribs::cage));
  double level = 0;
  for (const spine::Level& one : spine::levels()) {
    const Place disc = place(level);
    ++level;
    if (one.segment == "vertebra_l5" || one.segment == "head") continue;  // where `human` has them
    const std::string name(one.joint);
    const bool of_human = name == "t12_l1" || name == "c7_t1";  // on one end plate, where that is surer
    EXPECT_LT((body.joint(name).center - disc.at).norm(), of_human ? kGap : 1) << name;
    EXPECT_GT(body.confidence(name), 0.45) << name;
    EXPECT_GT(body.joint(name).axes.col(2).dot(disc.up), std::cos(2 / degrees_per_radian)) << name;
    EXPECT_NEAR(body.joint(name).axes.determinant(), 1, 1e-9);
  }
  EXPECT_EQ(body.rig.fits.size(), body.rig.skeleton.segments.size());
  for (std::size_t s = 0; s < body.rig.fits.size(); ++s)
    EXPECT_EQ(body.rig.fits[s].joint, body.rig.skeleton.segments[s].joint.name);
}

TEST(SplitSpine, JointsOfHumanStayWhereTheyAre) {
  const Case levels = drums(spine::Ribs::cage);
  Case whole = levels;
  whole.skeleton = *levels.whole_spine;
  whole.whole_spine = nullptr;
  for (CaseBone& bone : whole.bones) bone.segment = spine::whole_segment(bone.segment);
  const test::Found a = test::found(levels), b = test::found(whole);
  for (const Segment& segment : b.rig.skeleton.segments) {
    const Joint& same = a.joint(segment.joint.name);
    EXPECT_EQ(same.center, segment.joint.center) << segment.joint.name;
    EXPECT_EQ(same.axes, segment.joint.axes) << segment.joint.name;
    for (std::size_t i = 0; i < same.sequence.size(); ++i) {
      EXPECT_EQ(same.sequence[i].rest, segment.joint.sequence[i].rest);
      EXPECT_EQ(same.sequence[i].max, segment.joint.sequence[i].max);
    }
  }
}

TEST(SplitSpine, LevelsWithoutBoneAreTold) {
  const test::Found body = test::found(drums(spine::Ribs::cage, {"vertebra_l3", "vertebra_c4"}));
  EXPECT_EQ(
      std::count_if(body.warnings.begin(), body.warnings.end(),
                    [](const std::string& line) {
                      return line.starts_with("spine: vertebra_l3, vertebra_c4 have no bone of their own");
                    }),
      1);
  EXPECT_LT(body.rig.skeleton.find_segment("vertebra_l3"), 0);
  EXPECT_LT((body.joint("l2_l3").center - place(2.5).at).norm(),
            kHalf + kGap);  // amid the gap that L3 leaves
}

}  // namespace
}  // namespace ecorche::rig
