// SPDX-License-Identifier: Apache-2.0
// Work that may call exit(), or not come back, in a process of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <ecorche/values/context.hpp>

namespace ecorche::platform {

struct ChildOptions {
  double seconds = 600;                                 ///< of wall clock; then the child is killed
  std::uint64_t bytes = std::uint64_t{16} << 30;        ///< of memory on top of what the parent has
  std::string mend = "free some memory and try again";  ///< what to do where no process can be made
};

struct ChildResult {
  enum class End : std::uint8_t { done, failed, timed_out };
  End end = End::failed;
  std::vector<std::byte> bytes;  ///< what `work` returned, where done
  std::string said;              ///< the last line that it printed, where failed
};

/// Runs `work` in a forked child, its output caught, and hands back what it returns. The child is killed when
/// the time is over, when a stop is requested (throws Error{interrupted} within 0.1 s) and when the parent
/// dies. `work` may end the child in any way. It sees the parent's memory as it was, and only the calling
/// thread: it must use no other. Throws Error{internal} when no process can be made.
ChildResult run_in_child(const std::function<std::vector<std::byte>()>& work, const ChildOptions& options,
                         const Context& context);

}  // namespace ecorche::platform
