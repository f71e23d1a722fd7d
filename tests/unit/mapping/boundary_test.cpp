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

TEST(Boundary, equals_a_count_of_all_faces) {
  const auto mesh = test::letter_c();
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

}  // namespace
}  // namespace ecorche::mapping
