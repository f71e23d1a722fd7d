// SPDX-License-Identifier: Apache-2.0
// An operator new that fails when it is told to: for executables of their own.
#pragma once

#include "tests/unit/server/faults.hpp"

namespace ecorche::server {

/// The allocation that fails, counted where a thread handles something, or, `everywhere`, on all threads but
/// those that are spared.
extern Countdown allocations;
extern thread_local bool handling, spared;
extern std::atomic<bool> everywhere;

/// While it lives, threads that are not spared have so many bytes more than they had, and what they let go
/// of.
class Drought {
 public:
  explicit Drought(std::int64_t bytes);
  ~Drought();
  Drought(const Drought&) = delete;
  Drought& operator=(const Drought&) = delete;

  /// Allocations that failed.
  static int failed();
};

}  // namespace ecorche::server
