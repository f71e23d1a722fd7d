// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "phantom/phantom.hpp"
#include "tests/unit/phantom/mesh_checks.hpp"

namespace ecorche::phantom {
namespace {

TEST(Bar, IsFourBonesInARow) {
  for (const Size size : {Size::small, Size::standard, Size::paper}) {
    const Phantom bar = make_bar(size, {});
    expect_solid(bar.patient.skin, "skin");
    EXPECT_NEAR(volume(bar.patient.skin), 100.0 * 100 * 800, 1e-3);
    ASSERT_EQ(bar.patient.bones.size(), 4);
    double top = 0;
    for (const CaseBone& bone : bar.patient.bones) {
      expect_solid(bone.surface, bone.name);
      EXPECT_GE(bone.surface.V.col(2).minCoeff(), top + 20);
      top = bone.surface.V.col(2).maxCoeff();
    }
    EXPECT_LE(top, 780);
  }
}

TEST(Bar, TurnsHalfwayBetweenItsBones) {
  const Phantom bar = make_bar(Size::small, {});
  for (std::size_t i = 1; i < 4; ++i) {
    const double gap = (bar.patient.bones[i - 1].surface.V.col(2).maxCoeff() +
                        bar.patient.bones[i].surface.V.col(2).minCoeff()) /
                       2;
    EXPECT_NEAR(bar.truth.segments[i].joint.center.z(), gap, 1e-9);
    EXPECT_EQ(bar.truth.segments[i].joint.kind, JointKind::ball);
    EXPECT_TRUE(std::isinf(bar.truth.segments[i].joint.sequence[0].max));
  }
}

}  // namespace
}  // namespace ecorche::phantom
