// SPDX-License-Identifier: Apache-2.0
// Bodies of a population: whole, apart where limbs hang free, and as different as people are.
#include <gtest/gtest.h>

#include <set>

#include "tests/unit/phantom/small_phantom.hpp"

namespace ecorche::phantom {
namespace {

constexpr std::uint64_t kSeeds = 200;

TEST(Variety, DrawsFromTheWholeOfItsRanges) {
  double shortest = 2, tallest = 0, leanest = 99, fattest = 0, least_leg = 2, most_leg = 0;
  int whole = 0, twice = 0;
  std::set<std::string> missing;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Proportions of = varied_proportions(seed);
    shortest = std::min(shortest, of.height), tallest = std::max(tallest, of.height);
    leanest = std::min(leanest, of.fat), fattest = std::max(fattest, of.fat);
    least_leg = std::min(least_leg, of.leg), most_leg = std::max(most_leg, of.leg);
    whole += of.missing.empty();
    twice += of.missing.size() == 2;
    missing.insert(of.missing.begin(), of.missing.end());
    if (of.missing.size() == 2) {
      EXPECT_NE(of.missing[0], of.missing[1]);
    }
  }
  EXPECT_NEAR(shortest, 0.88, 0.01);
  EXPECT_NEAR(tallest, 1.09, 0.01);
  EXPECT_NEAR(leanest, 4, 0.5);
  EXPECT_NEAR(fattest, 14, 0.5);
  EXPECT_NEAR(least_leg, 0.93, 0.005);
  EXPECT_NEAR(most_leg, 1.02, 0.005);
  EXPECT_NEAR(whole, 0.75 * kSeeds, 0.1 * kSeeds);
  EXPECT_NEAR(twice, 0.0625 * kSeeds, 0.05 * kSeeds);
  EXPECT_GE(missing.size(), 7U);
}

TEST(Variety, EveryBodyHasFreeLimbsAndItsJointsInside) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Proportions of = varied_proportions(seed);
    const Body other = make_body(of);
    EXPECT_EQ(other.parts.size() + of.missing.size(), body().parts.size()) << seed;
    const Shape& skin = other.skin.shape;
    const Landmarks& at = other.at;
    for (const Vec& p : {at.knee, at.ankle, at.wrist, at.elbow, at.hip, at.shoulder})
      EXPECT_LT(skin.distance(p), -8) << seed;
    for (int step = -10; step < 6; ++step) {
      const double z = at.knee.z() + 25 * step;
      EXPECT_GT(skin.distance({0, 0, z}), 3) << "between the legs at " << z << " of " << seed;
    }
    double widest = -1e9;
    for (int step = 0; 100 + 4 * step < at.wrist.x(); ++step)
      widest = std::max(widest, skin.distance({100.0 + 4 * step, at.wrist.y(), at.wrist.z()}));
    EXPECT_GT(widest, 6) << "between hand and thigh of " << seed;
    for (const Part& part : other.parts) {
      EXPECT_EQ(std::count(of.missing.begin(), of.missing.end(), part.name), 0);
      if (part.mirror_of < 0) continue;
      const std::string& left = other.parts[static_cast<std::size_t>(part.mirror_of)].name;
      EXPECT_EQ(left.substr(0, left.rfind('_')), part.name.substr(0, part.name.rfind('_'))) << seed;
    }
  }
}

TEST(Variety, ATallerBodyIsTheSameBodyScaled) {
  std::uint64_t seed = 1;
  while (!varied_proportions(seed).missing.empty()) ++seed;
  const Proportions of = varied_proportions(seed);
  const Phantom varied = make(Size::small, seed, Context{}, 12, Variety::population);
  const Skeleton plain = make_skeleton(make_landmarks(of), false);
  ASSERT_EQ(varied.truth.segments.size(), plain.segments.size());
  for (std::size_t i = 0; i < plain.segments.size(); ++i) {
    const Joint &tall = varied.truth.segments[i].joint, &joint = plain.segments[i].joint;
    EXPECT_LT((tall.center - of.height * joint.center).norm(), 1e-9) << joint.name;
    EXPECT_EQ(tall.axes, joint.axes);
  }
  const Case& patient = varied.patient;
  for (const double edge : patient.labels->image.grid.spacing) EXPECT_NEAR(edge, 12, 1e-9);
  EXPECT_EQ(patient.labels->image.grid, patient.volumes.front().image.grid);
  // The label map shows the body where its surfaces are.
  const ImageGrid& grid = patient.labels->image.grid;
  const auto labels = patient.labels->image.scalars<std::uint8_t>();
  const Vec low = patient.skin.V.colwise().minCoeff(), high = patient.skin.V.colwise().maxCoeff();
  double lowest = 1e9, highest = -1e9;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        if (labels[grid.offset(i, j, k)] == 0) continue;
        lowest = std::min(lowest, grid.point(i, j, k)[2]);
        highest = std::max(highest, grid.point(i, j, k)[2]);
      }
    }
  }
  EXPECT_NEAR(lowest, low.z(), 14);
  EXPECT_NEAR(highest, high.z(), 14);
}

}  // namespace
}  // namespace ecorche::phantom
