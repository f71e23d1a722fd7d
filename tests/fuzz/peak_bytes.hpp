// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

namespace ecorche::fuzz {

/// Runs `work`, rethrows what it throws, and returns how many bytes were allocated at most beyond those of
/// before, by all threads.
std::int64_t peak_bytes(const std::function<void()>& work);

}  // namespace ecorche::fuzz
