// SPDX-License-Identifier: Apache-2.0
// An operator new that counts, for the whole process: link ecorche_counted_new into a test of its own.
#pragma once

#include <atomic>
#include <cstddef>

namespace ecorche::test {

/// Calls of operator new so far, of any thread and library.
extern std::atomic<std::size_t> allocated;

}  // namespace ecorche::test
