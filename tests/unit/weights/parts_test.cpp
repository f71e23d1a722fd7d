// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/parts.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "preprocess/weights/nearest_point.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::weights {
namespace {

TEST(Parts, AreFoundAndAttachedToTheNearest) {
  // Three slabs along x with gaps: [0, 30], [40, 50] and [70, 100]; the middle one has no bone and is nearer
  // to the first.
  const TetMesh mesh = test::box_mesh({10, 2, 2}, 10, [](const Eigen::Vector3d& p) -> std::uint16_t {
    return (p.x() > 30 && p.x() < 40) || (p.x() > 50 && p.x() < 70) ? test::kHole : 0;
  });
  const Parts parts = connected_parts(mesh.V.rows(), mesh.T);
  ASSERT_EQ(parts.count, 3);
  std::vector<std::uint8_t> boned(3, 1);
  std::int32_t middle = -1;
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    if (mesh.V(n, 0) == 40) middle = parts.of_node[static_cast<std::size_t>(n)];
  }
  boned[static_cast<std::size_t>(middle)] = 0;
  std::string said;
  Context context;
  context.log = [&](LogLevel level, std::string_view line) {
    EXPECT_EQ(level, LogLevel::warning);
    said += line;
  };
  const auto source = attachments(mesh.V, parts, boned, context);
  EXPECT_NE(said.find("a part of 18 nodes"), std::string::npos) << said;
  EXPECT_NE(said.find("10.00 mm"), std::string::npos) << said;
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    const auto from = source[static_cast<std::size_t>(n)];
    if (parts.of_node[static_cast<std::size_t>(n)] != middle) {
      EXPECT_EQ(from, -1);
      continue;
    }
    // Straight across the gap, even from x = 50, which is 20 mm from both neighbours.
    ASSERT_GE(from, 0);
    EXPECT_EQ(mesh.V.row(from), Eigen::RowVector3d(30, mesh.V(n, 1), mesh.V(n, 2)));
  }
}

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
}  // namespace ecorche::weights
