// SPDX-License-Identifier: Apache-2.0
// What newcomers are shown first, made beside streams.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "runtime/server/asio.hpp"
#include "runtime/server/workers.hpp"

namespace ecorche::server {

class Session;

/// While poses are streamed, sessions that only have their present pose to show, to who has just subscribed
/// or to who gets full detail, take turns: one job at a time, on a thread of its own that gives way. However
/// many open a body at once, whoever is served waits for none of them; whoever had least of the thread is
/// next. Where nothing is streamed, they are workers' jobs as any other. On the I/O thread.
class Openings {
 public:
  /// Poses are streamed until so long after the last.
  static constexpr std::chrono::milliseconds streaming{150};

  Openings() : aside_(1, giving_way) {}

  /// A pose is being made.
  void streamed(Clock::time_point now) { streamed_ = now; }
  bool beside_streams(Clock::time_point now) const { return now - streamed_ < streaming; }

  /// Somebody's first frame has to wait for memory; `large`: that nobody expects at once.
  void wait_for_room(Clock::time_point now, bool large) { (large ? large_wanted_ : room_wanted_) = now; }
  /// How long who holds memory and reads nothing may go on so, while somebody has to wait for it; nothing
  /// where nobody has to.
  std::optional<Clock::duration> patience(Clock::time_point now) const {
    if (now - room_wanted_ < streaming) return std::chrono::milliseconds(100);
    if (now - large_wanted_ < streaming) return std::chrono::seconds(1);
    return std::nullopt;
  }

  /// The session waits for its turn; once, however often it asks.
  void ask(const std::shared_ptr<Session>& session);
  /// Has the turn's work done; it must not throw.
  void submit(Job work, std::shared_ptr<Account> by = nullptr) {
    aside_.submit(std::move(work), std::move(by));
  }
  /// The turn is over.
  void done();
  /// No more turns.
  void stop() { stopped_ = true; }

 private:
  void next();

  std::deque<std::weak_ptr<Session>> waiting_;
  bool busy_ = false;  ///< a turn is taken
  bool stopped_ = false;
  Clock::time_point streamed_{}, room_wanted_{}, large_wanted_{};
  Workers aside_;
};

}  // namespace ecorche::server
