// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace ecorche::test {

struct Peak {
  std::uint64_t grown = 0;  ///< bytes of memory that `work` had touched at most, beyond those of before
  std::string error;        ///< what() of what it threw; empty where it came back
};

/// Runs `work` in a process of its own, as the kernel saw it (VmHWM). Throws std::runtime_error where that
/// process did not come to its end.
Peak peak_of(const std::function<void()>& work);

}  // namespace ecorche::test
