// SPDX-License-Identifier: Apache-2.0
// Random numbers that depend on a seed and an index only: same bytes in any order, on any number of threads.
#pragma once

#include <cstdint>

namespace ecorche::phantom {

/// SplitMix64's finaliser over seed and index.
inline std::uint64_t hash(std::uint64_t seed, std::uint64_t index) {
  std::uint64_t z = seed * 0x9E3779B97F4A7C15ULL + (index + 1) * 0xD1B54A32D192ED03ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

/// Uniform in [0, 1).
inline double uniform(std::uint64_t seed, std::uint64_t index) {
  return static_cast<double>(hash(seed, index) >> 11) * 0x1p-53;
}

/// Zero mean, unit variance, bell-shaped (the sum of four 16-bit uniforms; no libm, so the same on every
/// machine).
inline double gaussian(std::uint64_t seed, std::uint64_t index) {
  const std::uint64_t h = hash(seed, index);
  const auto sum = static_cast<double>((h & 0xFFFF) + (h >> 16 & 0xFFFF) + (h >> 32 & 0xFFFF) + (h >> 48));
  return (sum / 65536.0 - 2.0) * 1.7320508075688772;
}

}  // namespace ecorche::phantom
