// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/carry_back.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/geometry/closest_point.hpp"
#include "preprocess/mapping/bind.hpp"
#include "preprocess/mapping/tet_corners.hpp"
#include "tests/unit/mapping/lattices.hpp"

namespace ecorche::mapping {
namespace {

using Shares = Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor>;

// Where posing puts a point: the run time's formula, in double.
Points carried(const PointsF& nodes, const Tets& tets, const std::vector<std::int32_t>& tet,
               const Shares& share) {
  Points out(share.rows(), 3);
  for (Eigen::Index p = 0; p < share.rows(); ++p) {
    const auto x = corners_of(nodes, tets, tet[static_cast<std::size_t>(p)]);
    Eigen::Vector3d at = x[0];
    for (std::size_t c = 1; c < 4; ++c)
      at += static_cast<double>(share(p, static_cast<Eigen::Index>(c))) * (x[c] - x[0]);
    out.row(p) = at.transpose();
  }
  return out;
}

// A letter C, bent so that its arms overlap, with points in it and up to a tet's width outside.
struct Bent {
  test::FloatTets scan = test::letter_c();
  PointsF posed = scan.nodes;
  Points points{400, 3};
  Binding held;

  Bent() {
    for (Eigen::Index n = 0; n < posed.rows(); ++n) {
      const float x = posed(n, 0), y = posed(n, 1);
      if (y > 14) posed(n, 1) = y - 6 - 0.06F * x * x;  // the upper arm comes down through the lower
      posed(n, 2) += 0.3F * x;
    }
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-2, 26);
    for (double& x : points.reshaped()) x = place(random);
    held = Locator(scan.nodes, scan.tets).bind(points, {});
  }
  CarryingTets body() const { return {scan.nodes, posed, scan.tets}; }
};

TEST(CarryBack, WhatWasNotMovedComesBack) {
  const Bent bent;
  const Points there = carried(bent.posed, bent.scan.tets, bent.held.tet, bent.held.barycentric);
  const CarriedBack back = carry_back(bent.body(), there, bent.held.tet, bent.held.barycentric, {});
  EXPECT_GT(bent.held.outside, 20u);
  // Binding keeps 1e-3 mm; the way back adds nothing, wherever the arms lie in each other.
  EXPECT_LT((back.points - bent.points).rowwise().norm().maxCoeff(), 1e-3);
  int folded = 0;
  for (const std::uint8_t mark : back.folded) folded += mark;
  EXPECT_GT(folded, 0);
  EXPECT_LT(folded, 200);
}

// The slow twin: barycentric coordinates of the moved point in the posed tet, taken at rest.
TEST(CarryBack, IsTheInverseOfTheTet) {
  const Bent bent;
  std::mt19937 random(6);
  std::normal_distribution<double> nudge(0, 0.5);
  Points moved = carried(bent.posed, bent.scan.tets, bent.held.tet, bent.held.barycentric);
  for (double& x : moved.reshaped()) x += nudge(random);
  const CarriedBack back = carry_back(bent.body(), moved, bent.held.tet, bent.held.barycentric, {});
  int inside_out = 0, apart = 0;
  for (Eigen::Index p = 0; p < moved.rows(); ++p) {
    const std::int32_t t = bent.held.tet[static_cast<std::size_t>(p)];
    const auto posed = corners_of(bent.posed, bent.scan.tets, t),
               rest = corners_of(bent.scan.nodes, bent.scan.tets, t);
    const bool inverted = tet_det(posed[0], posed[1], posed[2], posed[3]) < 0;
    const bool folded = back.folded[static_cast<std::size_t>(p)] != 0;
    EXPECT_EQ(is_folded(bent.body(), t), folded);
    if (inverted) {
      EXPECT_TRUE(folded);
    }
    inside_out += inverted ? 1 : 0;
    const Eigen::Vector4d share = geometry::barycentric(moved.row(p).transpose(), posed);
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < 4; ++c) at += share[static_cast<Eigen::Index>(c)] * rest[c];
    const double away = (at - back.points.row(p).transpose()).norm();
    if (!folded) {
      EXPECT_LT(away, 1e-6 * (1 + at.norm()));
    }
    apart += away > 1e-3 ? 1 : 0;
  }
  EXPECT_GT(inside_out, 5);
  EXPECT_LT(apart, inside_out + 20) << "only a direction that is squeezed flat is held";
}

TEST(CarryBack, AFlatTetKeepsWhatWasNotMovedAndSendsNothingFar) {
  PointsF rest(4, 3), posed(4, 3);
  rest << 0, 0, 0, 10, 0, 0, 0, 10, 0, 0, 0, 10;
  posed = rest;
  posed(3, 2) = 0;  // flat
  Tets tets(1, 4);
  tets << 0, 1, 2, 3;
  Shares share(2, 4);
  share << 0.25F, 0.25F, 0.25F, 0.25F, 0.25F, 0.25F, 0.25F, 0.25F;
  Points points(2, 3);
  points << 2.5, 2.5, 0, 2.5, 2.5, 0.1;
  const CarriedBack back =
      carry_back({rest, posed, tets}, points, std::vector<std::int32_t>{0, 0}, share, {});
  EXPECT_EQ(back.folded, (std::vector<std::uint8_t>{1, 1}));
  EXPECT_LT((back.points.row(0) - Eigen::RowVector3d(2.5, 2.5, 2.5)).norm(), 1e-9);
  EXPECT_LT((back.points.row(1) - back.points.row(0)).norm(), 0.1 / kLeastStretch + 1e-9);
  rest.row(3) = rest.row(2);  // nor has it a volume at rest
  EXPECT_TRUE(
      carry_back({rest, posed, tets}, points, std::vector<std::int32_t>{0, 0}, share, {}).points.allFinite());
  EXPECT_TRUE(is_folded({rest, posed, tets}, 0));
}

}  // namespace
}  // namespace ecorche::mapping
