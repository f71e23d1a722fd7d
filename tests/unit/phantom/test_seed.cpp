// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/unit/phantom/small_phantom.hpp"

namespace ecorche::phantom {
namespace {

TEST(PhantomSeed, SameSeedSameBytesAnotherSeedAnotherBody) {
  Phantom again;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    again = make(Size::small, 1, Context{});
  }
  const Phantom other = make(Size::small, 2, Context{});
  const Case &a = small_phantom().patient, &b = again.patient, &c = other.patient;
  EXPECT_EQ(a.skin.V, b.skin.V);
  EXPECT_EQ(a.skin.F, b.skin.F);
  for (std::size_t i = 0; i < a.tissues.size(); ++i)
    EXPECT_EQ(a.tissues[i].surface.V, b.tissues[i].surface.V);
  for (std::size_t i = 0; i < a.volumes.size(); ++i)
    EXPECT_EQ(a.volumes[i].image.bytes, b.volumes[i].image.bytes);
  EXPECT_EQ(a.labels->image.bytes, b.labels->image.bytes);
  EXPECT_NE(a.volumes[1].image.bytes, c.volumes[1].image.bytes);
  EXPECT_FALSE(a.bones.back().surface.V.rows() == c.bones.back().surface.V.rows() &&
               a.bones.back().surface.V == c.bones.back().surface.V);
  EXPECT_NE(again.truth.segments[again.truth.segments.size() - 1].joint.center,
            other.truth.segments.back().joint.center);
}

}  // namespace
}  // namespace ecorche::phantom
