// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/boundary.hpp"

#include <gtest/gtest.h>

#include "tests/unit/mapping/exhaustive.hpp"
#include "tests/unit/mapping/lattices.hpp"

namespace ecorche::mapping {
namespace {

TEST(Boundary, one_tet_has_four_faces) {
  Tets tets(1, 4);
  tets << 2, 0, 3, 1;
  const auto faces = boundary_faces(4, tets);
  ASSERT_EQ(faces.size(), 4U);
  EXPECT_EQ(faces[0].node, (std::array<std::int32_t, 3>{0, 1, 2}));
  EXPECT_EQ(faces[3].node, (std::array<std::int32_t, 3>{1, 2, 3}));
}

void expect_equal_to_a_count(const test::FloatTets& mesh) {
  const auto expected = test::outer_faces(mesh.tets);
  const auto faces = boundary_faces(mesh.nodes.rows(), mesh.tets);
  ASSERT_EQ(faces.size(), expected.size());
  auto want = expected.begin();
  for (const BoundaryFace& face : faces) {  // both are sorted by node
    EXPECT_EQ(face.node, want->first);
    EXPECT_EQ(face.tet, want->second);
    ++want;
  }
}

TEST(Boundary, equals_a_count_of_all_faces) {
  expect_equal_to_a_count(test::letter_c());
  // Several pieces of work: what threads have summed comes together.
  const auto large =
      test::block(14, {0, 0, 0}, 0, [](int i, int j, int k) { return (i + 2 * j + 3 * k) % 5 != 0; });
  EXPECT_GT(large.tets.rows(), 2 * 4096);
  expect_equal_to_a_count(large);
}

}  // namespace
}  // namespace ecorche::mapping
