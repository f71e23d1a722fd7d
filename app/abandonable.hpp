// SPDX-License-Identifier: Apache-2.0
// Work that cannot be interrupted from inside (a factorization in a foreign library), made to end on Ctrl-C.
#pragma once

#include <functional>
#include <stop_token>

namespace ecorche::app {

/// Context::run_apart of this program: neither CHOLMOD nor Eigen can be asked to stop, a large factor takes
/// many seconds, and Ctrl-C is promised within one. Runs `work` in a thread of its own and waits for it;
/// rethrows what it throws. On a stop throws Error{interrupted} within 50 ms and leaves the work to run on.
void run_abandonable(std::function<void()> work, const std::stop_token& stop);

/// Ends main with `code`. Where work was abandoned the process leaves without the destructors of libraries,
/// streams flushed: OpenBLAS' takes the buffers away from under the thread, and the process would die of it
/// instead of leaving with its exit code.
int leave(int code);

}  // namespace ecorche::app
