// SPDX-License-Identifier: Apache-2.0
// Work that cannot be interrupted from inside (a factorization in a foreign library), made to end on a stop
// request.
#pragma once

#include <functional>

#include "core/values/context.hpp"

namespace ecorche::solve {

/// Runs `work` and waits for it; rethrows what it throws. When `context` asks for a stop first, throws
/// Error{interrupted} within 50 ms and leaves the work to run on by itself until it ends or the process does.
/// `work` must therefore own all it touches (shared pointers captured by value), never the caller's
/// references. A process that has abandoned work leaves by std::_Exit, streams flushed, with the status
/// given.
///
/// The one place in the libraries that starts a thread: neither CHOLMOD nor Eigen can be asked to stop, a
/// large factor takes many seconds, and Ctrl-C is promised within one. Without a stop token to watch the work
/// runs in the caller.
void run_abandonable(std::function<void()> work, const Context& context);

}  // namespace ecorche::solve
