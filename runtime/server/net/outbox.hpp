// SPDX-License-Identifier: Apache-2.0
// What waits to be written to one client.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>

#include <ecorche/wire/framing.hpp>
#include "runtime/server/net/asio.hpp"
#include "runtime/server/net/flow.hpp"

namespace ecorche::server {

using SharedFrame = std::shared_ptr<const wire::EncodedFrame>;

/// Answers leave in order and are never dropped. Of each subscription at most `in_flight` frames, or as
/// many as the way holds (Flow), are unacknowledged; then one waits, and a newer one replaces it. A keyframe
/// that waits is not replaced by the deltas against it: it leaves before them.
class Outbox {
 public:
  explicit Outbox(std::uint32_t in_flight) : limit_(in_flight) {}

  void answer(SharedFrame frame);
  /// The level of detail that the next frame of the subscription should have; see Flow. `still`: the finest,
  /// since nothing newer waits.
  std::uint32_t ask_level(std::uint32_t subscription, std::uint32_t finest, std::uint32_t coarsest,
                          bool still, Clock::time_point now);
  /// As Flow's; none before the subscription's first frame arrived.
  Clock::duration longest_gap(std::uint32_t subscription) const;
  /// `keyframe`: number of the frame that must have come before; its own where it is one; 0: needs none.
  /// False, and nothing is taken, where that one never left and does not wait either. A frame of another
  /// level than was asked for is for others.
  bool enqueue(std::uint32_t subscription, std::uint32_t level, std::uint64_t number, std::uint64_t keyframe,
               SharedFrame frame);
  /// Frame `number` of the subscription arrived, and with it every older one.
  void acknowledge(std::uint32_t subscription, std::uint64_t number, Clock::time_point now);
  /// Drops what waits for the subscription.
  void forget(std::uint32_t subscription) { lanes_.erase(subscription); }

  /// Drops everything; it goes with the last who holds the result. Throws bad_alloc, and drops nothing.
  std::shared_ptr<const void> clear();

  /// What to write next; answers first, then the subscriptions in turn. Null when nothing may go now.
  SharedFrame next(Clock::time_point now);

  /// The last of next() is written.
  void written(Clock::time_point now);

  /// Whether the last of next() was a subscription's.
  bool last_was_posed() const { return last_was_posed_; }

  std::size_t answers() const { return answers_.size(); }
  std::uint64_t answer_bytes() const;
  /// Of all that waits to be written.
  std::uint64_t bytes() const;
  /// A frame of the subscription was acknowledged.
  bool arrives(std::uint32_t subscription) const;
  /// When the frame left that has been on its way for longest.
  std::optional<Clock::time_point> oldest_in_flight() const;
  /// When the frame was written whose acknowledgement has been awaited for longest; one that is being written
  /// does not count.
  std::optional<Clock::time_point> oldest_written() const;
  /// Frames that a newer one replaced before they left.
  std::uint64_t replaced() const { return replaced_; }

 private:
  struct Waiting {
    SharedFrame frame;
    std::uint64_t number = 0;
  };
  struct Lane {
    explicit Lane(std::uint32_t few) : flow(few) {}
    Waiting keyframe, newest;                          ///< the keyframe leaves first
    std::uint32_t level = 0;                           ///< that was asked for last
    std::map<std::uint32_t, std::uint64_t> keyframes;  ///< by level: number of the last one that was taken
    Flow flow;
  };
  Lane& lane(std::uint32_t subscription) { return lanes_.try_emplace(subscription, limit_).first->second; }
  std::optional<Clock::time_point> oldest(std::optional<Clock::time_point> (Flow::*of)() const) const;

  std::uint32_t limit_;
  std::deque<SharedFrame> answers_;
  std::map<std::uint32_t, Lane> lanes_;
  std::uint32_t last_lane_ = 0;  ///< subscription that was served last
  std::uint64_t replaced_ = 0;
  bool last_was_posed_ = false;
};

}  // namespace ecorche::server
