// SPDX-License-Identifier: Apache-2.0
// A hash of whole numbers that may be summed.
#pragma once

#include <cstdint>

namespace ecorche::solve {

/// splitmix64's finaliser (Steele et al., Fast Splittable Pseudorandom Number Generators, 2014): one to one,
/// and every bit of the argument reaches every bit of the result. 0 stays 0.
constexpr std::uint64_t mix(std::uint64_t x) {
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9ULL;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

}  // namespace ecorche::solve
