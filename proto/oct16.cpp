// SPDX-License-Identifier: Apache-2.0
#include "proto/oct16.hpp"

#include <cmath>
#include <cstdlib>

namespace ecorche::wire {
namespace {

constexpr std::int8_t kNone = -128;
constexpr int kOne = 127;

float sign(float x) {
  return x < 0 ? -1.0F : 1.0F;
}

std::int8_t narrow(float x) {
  return static_cast<std::int8_t>(x * 127 + sign(x) * 0.5F);
}

}  // namespace

void to_oct16(std::span<const std::int16_t> unit, std::span<std::int8_t> out) {
  for (std::size_t i = 0; 2 * i + 1 < out.size(); ++i) {
    const float x = unit[3 * i], y = unit[3 * i + 1], z = unit[3 * i + 2];
    const float length = std::abs(x) + std::abs(y) + std::abs(z);
    if (length == 0) {
      out[2 * i] = out[2 * i + 1] = kNone;
      continue;
    }
    float u = x / length, v = y / length;
    if (z < 0) {
      // The lower half folds over the edges of the upper one.
      const float folded = (1 - std::abs(v)) * sign(u);
      v = (1 - std::abs(u)) * sign(v);
      u = folded;
    }
    out[2 * i] = narrow(u);
    out[2 * i + 1] = narrow(v);
  }
}

std::array<float, 3> from_oct16(std::int8_t u, std::int8_t v) {
  if (u == kNone && v == kNone) return {0, 0, 0};
  // In 127ths, whole numbers: kernels::to_normals() has the same bits on any processor.
  int x = +u, y = +v;
  const int z = kOne - std::abs(x) - std::abs(y);
  if (z < 0) {
    const int folded = x < 0 ? std::abs(y) - kOne : kOne - std::abs(y);
    y = y < 0 ? std::abs(x) - kOne : kOne - std::abs(x);
    x = folded;
  }
  const float length = std::sqrt(static_cast<float>(x * x + y * y + z * z));
  return {static_cast<float>(x) / length, static_cast<float>(y) / length, static_cast<float>(z) / length};
}

}  // namespace ecorche::wire
