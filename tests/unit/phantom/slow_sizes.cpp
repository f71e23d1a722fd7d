// SPDX-License-Identifier: Apache-2.0
// The sizes that issue and paper ask for.
#include <gtest/gtest.h>

#include <cstdio>

#include "phantom/phantom.hpp"

namespace ecorche::phantom {
namespace {

Eigen::Index vertices(const Case& patient) {
  Eigen::Index n = patient.skin.V.rows();
  for (const CaseBone& bone : patient.bones) n += bone.surface.V.rows();
  for (const CaseTissue& tissue : patient.tissues) n += tissue.surface.V.rows();
  return n;
}

TEST(PhantomSizes, StandardHasAbout150kVertices) {
  const Phantom phantom = make(Size::standard, 1, Context{});
  EXPECT_NEAR(static_cast<double>(vertices(phantom.patient)), 150e3, 15e3);
}

TEST(PhantomSizes, PaperIsAsLargeAsTheLargestModelOfSujar18) {
  const Phantom phantom = make(Size::paper, 1, Context{});
  const auto& size = phantom.patient.volumes[0].image.grid.size;
  std::printf("%ld vertices, image %d x %d x %d\n", static_cast<long>(vertices(phantom.patient)), size[0],
              size[1], size[2]);
  EXPECT_GE(vertices(phantom.patient), 1'280'000);
  EXPECT_LE(vertices(phantom.patient), 1'500'000);
  EXPECT_NEAR(size[0], 250, 10);
  EXPECT_NEAR(size[1], 120, 12);
  EXPECT_NEAR(size[2], 700, 10);
}

}  // namespace
}  // namespace ecorche::phantom
