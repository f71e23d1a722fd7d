// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "preprocess/weights/harmonic.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::weights {
namespace {

/// The square [x, x] x [0, 40] x [0, 40]: the part of a bone's surface that matters here.
SurfaceMesh wall(double x) {
  SurfaceMesh s;
  s.V.resize(4, 3);
  s.V << x, 0, 0, x, 40, 0, x, 40, 40, x, 0, 40;
  s.F.resize(2, 3);
  s.F << 0, 1, 2, 0, 2, 3;
  return s;
}

TEST(BoneNodes, ContestedNodesGoToTheNearestSurface) {
  // Bone 0 fills x < 20, bone 1 the rest: all nodes with x = 20 touch both. Walls: at 19 and at 20.5.
  const TetMesh mesh =
      test::box_mesh({4, 4, 4}, 10, [](const Eigen::Vector3d& p) { return p.x() < 20 ? 1 : 2; });
  Case patient;
  patient.bones = {{"a", "s", wall(19)}, {"b", "t", wall(20.5)}};
  const auto owner = bone_nodes(mesh, patient, {3, 1});
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    EXPECT_EQ(owner[static_cast<std::size_t>(n)], mesh.V(n, 0) < 20 ? 3 : 1) << mesh.V.row(n);
  }
  // As near to one as to the other: the lower bone.
  patient.bones[1].surface = wall(21);
  const auto tied = bone_nodes(mesh, patient, {3, 1});
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    EXPECT_EQ(tied[static_cast<std::size_t>(n)], mesh.V(n, 0) <= 20 ? 3 : 1) << mesh.V.row(n);
  }
}

TEST(BoneNodes, BonesOfOneSegmentDoNotContest) {
  const TetMesh mesh = test::box_mesh({4, 1, 1}, 10, [](const Eigen::Vector3d& p) {
    return p.x() < 20 ? 1 : p.x() < 30 ? 2 : 0;
  });
  Case patient;
  patient.bones.resize(2);  // no surfaces: nobody may ask
  const auto owner = bone_nodes(mesh, patient, {5, 5});
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    EXPECT_EQ(owner[static_cast<std::size_t>(n)], mesh.V(n, 0) <= 30 ? 5 : -1);
  }
}

TEST(BoneNodes, RefusesALabelWithoutABone) {
  const TetMesh mesh = test::box_mesh({1, 1, 1}, 10, [](const Eigen::Vector3d&) { return 3; });
  expect_error(ErrorKind::internal, "weights: tet 0 has the label 3 of 2 bones (report it)", [&] {
    bone_nodes(mesh, Case{}, {0, 1});
  });
}

}  // namespace
}  // namespace ecorche::weights
