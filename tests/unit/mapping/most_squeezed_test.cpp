// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/most_squeezed.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/geometry/closest_point.hpp"
#include "preprocess/mapping/tet_corners.hpp"
#include "preprocess/mapping/tet_grid.hpp"

namespace ecorche::mapping {
namespace {

// The slow twin: every tet.
std::int32_t most_squeezed_of_all(const Eigen::Vector3d& p, const PointsF& rest, const PointsF& posed,
                                  const Tets& tets) {
  std::int32_t found = -1;
  double most = 0;
  for (Eigen::Index t = 0; t < tets.rows(); ++t) {
    const auto now = corners_of(posed, tets, t), was = corners_of(rest, tets, t);
    const double det = std::abs(tet_det(now[0], now[1], now[2], now[3]));
    if (det == 0 || geometry::barycentric(p, now).minCoeff() < 0) continue;
    const double squeezed = std::abs(tet_det(was[0], was[1], was[2], was[3])) / det;
    if (squeezed <= most) continue;
    most = squeezed;
    found = static_cast<std::int32_t>(t);
  }
  return found;
}

TEST(MostSqueezed, IsThatOfASearchThroughAll) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(0, 10);
  PointsF rest(240, 3), posed(240, 3);
  for (float& x : rest.reshaped()) x = place(random);
  for (float& x : posed.reshaped()) x = place(random);
  Tets tets(300, 4);                      // a heap of them, half inverted
  for (Eigen::Index t = 0; t < 300; ++t)  // four different nodes each
    for (int c = 0; c < 4; ++c)
      tets(t, c) = static_cast<std::int32_t>(60 * c + static_cast<int>(random() % 60));
  const TetGrid grid(posed, tets, {});
  int held = 0, inverted = 0;
  Points points(500, 3);
  for (double& x : points.reshaped()) x = static_cast<double>(place(random)) * 1.2 - 1;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const Eigen::Vector3d at = points.row(p).transpose();
    const std::int32_t tet = most_squeezed_of_all(at, rest, posed, tets);
    EXPECT_EQ(grid.most_squeezed(at, rest), tet);
    if (tet < 0) continue;
    ++held;
    const auto now = corners_of(posed, tets, tet);
    inverted += tet_det(now[0], now[1], now[2], now[3]) < 0 ? 1 : 0;
  }
  EXPECT_GT(held, 100);
  EXPECT_GT(inverted, 30);
  EXPECT_EQ(TetGrid(posed, Tets(0, 4), {}).most_squeezed({1, 2, 3}, rest), -1);

  // Bound by it, a point has that tet, and shares that give its place back.
  Binding binding = Locator(posed, tets).bind(points, {});
  const Binding before = binding;
  bind_to_most_squeezed(points, rest, posed, tets, binding, {});
  std::uint64_t outside = 0;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const auto row = static_cast<std::size_t>(p);
    const std::int32_t tet = most_squeezed_of_all(points.row(p).transpose(), rest, posed, tets);
    EXPECT_EQ(binding.tet[row], tet < 0 ? before.tet[row] : tet);
    outside += tet < 0 ? 1 : 0;
    EXPECT_EQ(binding.outside_mm[row] == 0, tet >= 0);
    const auto corners = corners_of(posed, tets, binding.tet[row]);
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < 4; ++c)
      at += static_cast<double>(binding.barycentric(p, static_cast<Eigen::Index>(c))) * corners[c];
    if (tet >= 0) {
      EXPECT_LT((at - points.row(p).transpose()).norm(), 1e-4);
    }
  }
  EXPECT_EQ(binding.outside, outside);
  EXPECT_GE(before.outside, outside);
}

}  // namespace
}  // namespace ecorche::mapping
