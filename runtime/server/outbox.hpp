// SPDX-License-Identifier: Apache-2.0
// What waits to be written to one client.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>

#include "proto/framing.hpp"
#include "runtime/server/asio.hpp"

namespace ecorche::server {

using SharedFrame = std::shared_ptr<const wire::EncodedFrame>;

/// Answers leave in order and are never dropped. Of each subscription at most `in_flight` frames are on their
/// way unacknowledged; then one waits, and a newer one replaces it.
class Outbox {
 public:
  explicit Outbox(std::uint32_t in_flight) : limit_(in_flight) {}

  void answer(wire::EncodedFrame frame);
  void offer(std::uint32_t subscription, std::uint64_t number, SharedFrame frame);
  /// Frame `number` of the subscription arrived, and with it every older one.
  void acknowledge(std::uint32_t subscription, std::uint64_t number);
  /// Drops what waits for the subscription.
  void forget(std::uint32_t subscription) { lanes_.erase(subscription); }

  /// What to write next; answers first, then the subscriptions in turn. Null when nothing may go now.
  SharedFrame next(Clock::time_point now);

  /// Whether the last of next() was a subscription's.
  bool last_was_posed() const { return last_was_posed_; }

  std::size_t answers() const { return answers_.size(); }
  /// When the frame left that has been on its way for longest.
  std::optional<Clock::time_point> oldest_in_flight() const;
  /// Frames that a newer one replaced before they left.
  std::uint64_t replaced() const { return replaced_; }

 private:
  struct InFlight {
    std::uint64_t number;
    Clock::time_point left;
  };
  struct Lane {
    SharedFrame waiting;
    std::uint64_t waiting_number = 0;
    std::deque<InFlight> in_flight;
  };

  std::uint32_t limit_;
  std::deque<SharedFrame> answers_;
  std::map<std::uint32_t, Lane> lanes_;
  std::uint32_t last_lane_ = 0;  ///< subscription that was served last
  std::uint64_t replaced_ = 0;
  bool last_was_posed_ = false;
};

}  // namespace ecorche::server
