// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/nearest_point.hpp"

#include <gtest/gtest.h>

#include <random>

namespace ecorche::geometry {
namespace {

TEST(NearestPoint, EqualsTheSearchOverAllPoints) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const Eigen::RowVector3d& size :
       {Eigen::RowVector3d(100, 100, 100), Eigen::RowVector3d(1000, 1, 0), Eigen::RowVector3d(0, 0, 0)}) {
    Points V(400, 3);
    std::vector<std::int32_t> subset;
    for (Eigen::Index n = 0; n < V.rows(); ++n) {
      V.row(n) = size.cwiseProduct(Eigen::RowVector3d(unit(random), unit(random), unit(random)));
      if (n % 3 != 1) subset.push_back(static_cast<std::int32_t>(n));
    }
    const NearestPoint grid(V, subset);
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3d p =
          300 * Eigen::Vector3d(unit(random), unit(random), unit(random)) - Eigen::Vector3d(100, 100, 100);
      double best = 1e300, found = 0;
      std::int32_t expected = -1;
      for (const std::int32_t n : subset) {
        const double d = (V.row(n).transpose() - p).squaredNorm();
        if (d < best) {
          best = d;
          expected = n;
        }
      }
      EXPECT_EQ(grid.find(p, found), expected);
      EXPECT_EQ(found, best);
    }
  }
}

}  // namespace
}  // namespace ecorche::geometry
