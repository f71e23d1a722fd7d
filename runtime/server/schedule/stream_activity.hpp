// SPDX-License-Identifier: Apache-2.0
// What goes on in all sessions together, as far as each minds it.
#pragma once

#include <chrono>
#include <optional>

#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

/// Whether poses are streamed, and whether somebody has to wait for memory. Plain bookkeeping; every time
/// comes from the caller. On the I/O thread.
class StreamActivity {
 public:
  /// Poses are streamed until so long after the last.
  static constexpr std::chrono::milliseconds streaming{150};

  /// A pose is being made.
  void streamed(Clock::time_point now) { streamed_ = now; }
  bool beside_streams(Clock::time_point now) const { return now - streamed_ < streaming; }

  /// Somebody's first frame has to wait for memory; `large`: that nobody expects at once.
  void wait_for_memory(Clock::time_point now, bool large) { (large ? large_wanted_ : memory_wanted_) = now; }
  /// How long who holds memory and reads nothing may go on so, while somebody has to wait for it; nothing
  /// where nobody has to.
  std::optional<Clock::duration> patience(Clock::time_point now) const {
    if (now - memory_wanted_ < streaming) return std::chrono::milliseconds(100);
    if (now - large_wanted_ < streaming) return std::chrono::seconds(1);
    return std::nullopt;
  }

 private:
  Clock::time_point streamed_{}, memory_wanted_{}, large_wanted_{};
};

}  // namespace ecorche::server
