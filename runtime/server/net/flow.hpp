// SPDX-License-Identifier: Apache-2.0
// What acknowledgements say of the way to one client (docs/reference/protocol.md, "Slow networks").
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

/// Of one subscription of one connection. Plain bookkeeping; every time comes from the caller.
class Flow {
 public:
  /// `few`: frames that may always be on their way.
  explicit Flow(std::uint32_t few) : few_(few) {}

  void left(std::uint64_t number, Clock::time_point now);
  /// All that left is written.
  void written(Clock::time_point now);
  /// Frame `number` arrived, and with it every older one.
  void arrived(std::uint64_t number, Clock::time_point now);

  /// `few`, and beyond them, up to `most_in_flight`, as many as the way itself holds: while the oldest one is
  /// not overdue by more than half of the shortest delay that was seen.
  bool may_leave(Clock::time_point now) const;

  /// The level of detail for the next frame, `finest` to `coarsest`. Late acknowledgements make it coarser,
  /// by as many levels as the delay asks for; a second of prompt ones makes it finer by one, and when that
  /// was too much, the next try waits twice as long. Late is beyond the shortest delay of the last 10 s and
  /// as much again (at least 40, at most 100 ms: a packet that is sent again is not late), and anyway beyond
  /// 180 ms while there is a coarser level: the shortest delay of large frames says little about the way.
  std::uint32_t level(std::uint32_t finest, std::uint32_t coarsest, Clock::time_point now);

  /// For so long a lost packet may keep those behind it waiting: two of the shortest delays, since it is
  /// missed after one and sent again in another; half a second at most. None before a frame arrived.
  Clock::duration longest_gap() const;

  /// Some frame arrived.
  bool arrives() const { return shortest_.has_value(); }
  /// When the oldest one left that is on its way.
  std::optional<Clock::time_point> oldest() const;
  /// When it was written; nothing while it is being written.
  std::optional<Clock::time_point> oldest_written() const;
  static constexpr std::size_t most_in_flight = 16;

 private:
  struct InFlight {
    std::uint64_t number;
    Clock::time_point left;
    std::optional<Clock::time_point> written = {};
  };
  Clock::duration late() const;
  void judge(Clock::duration delay, Clock::time_point now);
  void coarser(Clock::duration delay, Clock::time_point now);

  std::uint32_t few_;
  std::deque<InFlight> in_flight_;
  std::optional<Clock::duration> shortest_,
      next_shortest_;  // delay, of the last 10 s and of this spell of them
  Clock::time_point spell_{};

  std::uint32_t level_ = 0, most_ = 0;  // above the finest
  int late_ones_ = 0;
  std::optional<Clock::time_point> prompt_since_, finer_at_;
  Clock::time_point changed_{};
  Clock::duration patience_ = std::chrono::seconds(1);
};

}  // namespace ecorche::server
