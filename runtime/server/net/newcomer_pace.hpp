// SPDX-License-Identifier: Apache-2.0
// How soon after one newcomer at a port the next is let in.
#pragma once

#include <chrono>
#include <optional>

namespace ecorche::server {

/// However many come at once, they wait in the kernel, and those who are served go on between two of them.
/// They are let in faster once the kernel's queue has not been empty for long: then they come faster than
/// they are let in, and who is last would wait for seconds.
class NewcomerPace {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr Clock::duration between = std::chrono::milliseconds(2);
  static constexpr Clock::duration long_wait = std::chrono::seconds(2);
  static constexpr Clock::duration between_many = std::chrono::microseconds(500);

  /// Nobody waited when the next was asked for.
  void nobody() { busy_since_.reset(); }
  /// One was let in at `now`: how long to leave the others waiting.
  Clock::duration after(Clock::time_point now) {
    if (!busy_since_) busy_since_ = now;
    return now - *busy_since_ > long_wait ? between_many : between;
  }

 private:
  std::optional<Clock::time_point> busy_since_;  // since when the queue was not found empty
};

}  // namespace ecorche::server
