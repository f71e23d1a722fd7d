// SPDX-License-Identifier: Apache-2.0
// Work beside the stream: one turn at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <utility>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/schedule/workers.hpp"

namespace ecorche::server {

/// What somebody does when a TurnQueue calls it. Its owner holds it, and gives it out as a shared_ptr that
/// shares the owner's count, so that it is gone with its owner.
class Turn {
 public:
  /// `begin`: has the turn's work done, and TurnQueue::done() called then; false where there is none any
  /// more. `account`: for whom; read when turns are compared.
  Turn(std::function<bool()> begin, std::shared_ptr<Account> account)
      : begin_(std::move(begin)), account_(std::move(account)) {}
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

  bool awaited() const { return awaited_; }

 private:
  friend class TurnQueue;
  std::function<bool()> begin_;
  std::shared_ptr<Account> account_;
  bool awaited_ = false;
};

/// One turn at a time, wherever its work is done. On the I/O thread.
class TurnQueue {
 public:
  enum class Order : std::uint8_t {
    first_come,
    least_used,  ///< whoever had least of the threads is next
  };

  /// `pause`: after a turn there is none for so many times as long as it cost.
  TurnQueue(net::io_context& io, Order order, int pause = 0) : timer_(io), order_(order), pause_(pause) {}

  /// Its turn comes; once, however often it asks.
  void ask(const std::shared_ptr<Turn>& turn);
  /// The turn is over; it took so much of a processor.
  void done(Clock::duration cost = {});
  /// No more turns.
  void stop();

 private:
  void next();
  std::shared_ptr<Turn> take();

  net::steady_timer timer_;
  Order order_;
  int pause_;
  std::deque<std::weak_ptr<Turn>> waiting_;
  bool busy_ = false;     ///< a turn is taken
  bool resting_ = false;  ///< the timer runs
  bool stopped_ = false;
};

}  // namespace ecorche::server
