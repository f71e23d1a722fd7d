// SPDX-License-Identifier: Apache-2.0
// How long a client may take for what it is sent (docs/reference/protocol.md, "Limits").
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

/// Bytes a second that a client has to take, on the whole of a write. What the kernel keeps of a frame that
/// has been written (a MiB) has left at this rate before the frame's acknowledgement is overdue.
inline constexpr double least_rate = 125e3;

/// What is being written to one client.
struct Writing {
  Clock::time_point since;
  std::uint64_t bytes = 0;
};

/// When the write is stalled, unless it is over or more of it was taken by then: `patience` after `moved`
/// (Transport::moved(); before the write: after its beginning), and anyway where it takes longer than
/// `patience` and its bytes at `least_rate`. `strict`, or where nothing is known to have moved: `patience`
/// after its beginning.
inline Clock::time_point stalled_at(const Writing& write, std::optional<Clock::time_point> moved,
                                    Clock::duration patience, bool strict) {
  if (strict || !moved) return write.since + patience;
  const Clock::duration at_least_rate = duration(static_cast<double>(write.bytes) / least_rate);
  return patience + std::min(std::max(write.since, *moved), write.since + at_least_rate);
}

}  // namespace ecorche::server
