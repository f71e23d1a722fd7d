// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/parts.hpp"

#include <gtest/gtest.h>

#include <string>

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

}  // namespace
}  // namespace ecorche::weights
