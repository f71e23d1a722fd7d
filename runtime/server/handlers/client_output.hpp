// SPDX-License-Identifier: Apache-2.0
// What is on its way to one client: what waits, what is being written, and whether it reads.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "runtime/server/net/close_reason.hpp"
#include "runtime/server/net/outbox.hpp"
#include "runtime/server/net/patience.hpp"
#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/resources/metrics.hpp"
#include "runtime/server/resources/options.hpp"
#include "runtime/server/session/pose_job.hpp"

namespace ecorche::server {

/// The queue that the connection's writing coroutine empties; it knows no socket. Whoever adds to it wakes
/// the writer, which waits for wake() while next() has nothing.
class ClientOutput {
 public:
  /// One write: answers, and then at most one frame of a subscription.
  struct Write {
    std::vector<SharedFrame> frames;
    std::vector<net::const_buffer> buffers;
    bool posed = false;  ///< the last of them is a subscription's
  };

  ClientOutput(const net::any_io_executor& executor, const Limits& limits, const MemoryBudget& memory,
               Metrics& metrics);

  void answer(const v1::Envelope& envelope, std::shared_ptr<const wire::Payload> payload);
  /// The same for several clients.
  void answer(SharedFrame frame);
  /// As Member::deliver.
  bool deliver(const PosedFrame& frame);
  std::uint32_t ask_level(std::uint32_t subscription, std::uint32_t finest, std::uint32_t coarsest,
                          bool still) {
    return outbox_.ask_level(subscription, finest, coarsest, still, Clock::now());
  }
  /// As Member's.
  Clock::duration longest_gap(std::uint32_t subscription) const { return outbox_.longest_gap(subscription); }
  /// As Member::may_take: within the client's share; who reads may have another frame made while the last one
  /// is written, however large they are. Where all memory is taken, only of what has been read.
  bool may_take(std::uint32_t subscription, std::uint64_t more) const;
  /// The client has the frame, and every older one.
  void acknowledge(std::uint32_t subscription, std::uint64_t frame);
  /// Drops what waits for the subscription.
  void forget(std::uint32_t subscription) { outbox_.forget(subscription); }
  /// Drops all that waits; it goes with the last who holds the result. Throws bad_alloc, and drops nothing.
  std::shared_ptr<const void> clear() { return outbox_.clear(); }
  /// So few answers wait that the client may ask for more.
  bool takes_answers() const;

  /// Nothing leaves after the answers that wait. `why`: for carriers that have words for it.
  void finish(CloseReason why) { finished_by_ = why; }
  std::optional<CloseReason> finished_by() const { return finished_by_; }

  /// What to write now, under way until written() or failed(); null where nothing may leave. `join`: frames
  /// may leave in one write.
  const Write* next(Clock::time_point now, bool join);
  void written(Clock::time_point now);
  /// The write ended with an error; what it held is the caller's to destroy.
  std::shared_ptr<const void> failed();
  bool writing() const { return writing_.has_value(); }
  net::steady_timer& wake() { return wake_; }

  /// Of all that waits or is being written.
  std::uint64_t bytes() const { return outbox_.bytes() + (writing_ ? writing_->bytes : 0); }
  /// When what was sent counts as stalled, should no more be read or acknowledged until then. `moved`: as
  /// Transport::moved(). `strict`: it is not enough that something moves.
  std::optional<Clock::time_point> stalls_at(std::optional<Clock::time_point> moved, Clock::duration patience,
                                             bool strict) const;
  /// All bytes(), where the client has taken none of them for `patience`; 0 where it has.
  std::uint64_t unread(Clock::time_point now, std::optional<Clock::time_point> moved,
                       Clock::duration patience) const;

 private:
  const MemoryBudget& memory_;
  Metrics& metrics_;
  std::uint64_t share_;  ///< of the memory, that one client may fill
  Outbox outbox_;
  net::steady_timer wake_;
  Write write_;
  std::optional<Writing> writing_;  ///< the present write
  std::optional<CloseReason> finished_by_;
};

}  // namespace ecorche::server
