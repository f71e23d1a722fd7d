// SPDX-License-Identifier: Apache-2.0
#include "proto/oct16.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <vector>

#include "proto/float_kernels.hpp"

namespace ecorche::wire {
namespace {

TEST(Oct16, EveryDirectionComesBackWithinADegree) {
  double worst = 0;
  constexpr int count = 100'000;
  for (int i = 0; i < count; ++i) {
    // A spiral over the whole sphere.
    const double z = 1 - 2 * (i + 0.5) / count, r = std::sqrt(1 - z * z), turn = 2.399963 * i;
    const double n[3] = {r * std::cos(turn), r * std::sin(turn), z};
    std::int16_t unit[3];
    for (int c = 0; c < 3; ++c) unit[c] = static_cast<std::int16_t>(std::lround(32767 * n[c]));
    std::int8_t packed[2];
    to_oct16(unit, packed);
    const auto back = from_oct16(packed[0], packed[1]);
    const double cosine = back[0] * n[0] + back[1] * n[1] + back[2] * n[2];
    worst = std::max(worst, std::acos(std::min(1.0, cosine)) * 180 / M_PI);
    ASSERT_NEAR(std::hypot(back[0], back[1], back[2]), 1, 1e-6);
  }
  EXPECT_LT(worst, 1.0);
  EXPECT_GT(worst, 0.1);
}

TEST(Oct16, TheKernelIsThatOfAllPairs) {
  std::vector<std::int8_t> packed;
  for (int u = -128; u < 128; ++u) {
    for (int v = -128; v < 128; ++v) {
      packed.push_back(static_cast<std::int8_t>(u));
      packed.push_back(static_cast<std::int8_t>(v));
    }
  }
  std::vector<float> unit(packed.size() / 2 * 3);
  kernels::to_normals(packed, unit);
  for (std::size_t i = 0; i < packed.size() / 2; ++i) {
    const auto one = from_oct16(packed[2 * i], packed[2 * i + 1]);
    for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(unit[3 * i + c], one[c]) << i << " axis " << c;
  }
  // Whatever is left over behind the last whole vector; nothing is written behind it.
  for (std::size_t count = 0; count < 70; ++count) {
    std::vector<float> few(3 * count + 1, 7.0F);
    kernels::to_normals(std::span(packed).subspan(1000, 2 * count), std::span(few).first(3 * count));
    for (std::size_t i = 0; i < 3 * count; ++i) ASSERT_EQ(few[i], unit[1500 + i]) << i << " of " << count;
    ASSERT_EQ(few.back(), 7.0F);
  }
}

TEST(Oct16, GoldenNumbers) {
  const std::int16_t unit[] = {32767, 0, 0,      0, -32767, 0, 0,      0,     32767,
                               0,     0, -32767, 0, 0,      0, -18918, 18918, -18918};
  std::int8_t packed[12];
  to_oct16(unit, packed);
  const std::int8_t expected[] = {127, 0, 0, -127, 0, 0, 127, 127, -128, -128, -85, 85};
  for (int i = 0; i < 12; ++i) EXPECT_EQ(packed[i], expected[i]) << i;
  const auto none = from_oct16(-128, -128);
  EXPECT_EQ(none[0], 0.0F);
  EXPECT_EQ(none[1], 0.0F);
  EXPECT_EQ(none[2], 0.0F);
}

}  // namespace
}  // namespace ecorche::wire
