// SPDX-License-Identifier: Apache-2.0
// What targets share: how a broken promise ends the program, and how long frames may be.
#pragma once

#include <cstdio>
#include <cstdlib>

#include <ecorche/wire/framing.hpp>

namespace ecorche::fuzz {

inline constexpr wire::FrameLimits kFrameLimits{.envelope_bytes = 1 << 16, .payload_bytes = 1 << 16};

/// Aborts unless `holds`, and says what was promised.
inline void must(bool holds, const char* promise = "a promise") {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", promise);
  std::abort();
}

}  // namespace ecorche::fuzz
