// SPDX-License-Identifier: Apache-2.0
#include "preprocess/cor/stencil.hpp"

#include <gtest/gtest.h>

namespace ecorche::cor {
namespace {

TEST(CubicStencil, IsExactForCubicsAndStaysOnTheGrid) {
  const auto cubic = [](float x) { return 0.3F * x * x * x - 2 * x * x + x + 5; };
  for (float u = 0; u <= 7; u += 0.0625F) {
    const CubicStencil stencil(u, 7);
    ASSERT_GE(stencil.first, 0);
    ASSERT_LE(stencil.first + 3, 7);
    float sum = 0;
    for (int i = 0; i < 4; ++i) {
      sum += stencil.w[static_cast<std::size_t>(i)] * cubic(static_cast<float>(stencil.first + i));
    }
    EXPECT_NEAR(sum, cubic(u), 1e-4F) << u;
  }
}

}  // namespace
}  // namespace ecorche::cor
