// SPDX-License-Identifier: Apache-2.0
// By when a client must have done something (docs/reference/protocol.md, "Limits").
#pragma once

#include <cstdint>
#include <optional>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/resources/options.hpp"

namespace ecorche::server {

/// Points in time that the server looks at when the first is due, and ten times a second, so that no read or
/// write needs a timer of its own. Plain bookkeeping; every time comes from the caller.
class ConnectionDeadlines {
 public:
  /// In the order in which they are looked at.
  enum class Missed : std::uint8_t {
    none,
    last_words,  ///< it was told why its connection ends, and had a second to read it
    handshake,   ///< of TLS or a WebSocket
    hello,
    stall,         ///< what was sent to it was not read or acknowledged
    half_message,  ///< the rest of one
    idle           ///< anything at all
  };
  /// Where the connection stands.
  struct State {
    bool opened = false;   ///< the transport's handshake is over
    bool greeted = false;  ///< the hellos are exchanged
    std::optional<Clock::time_point> ending_since = {}, stalls_at = {}, unfinished_since = {};
  };
  struct Result {
    Missed missed = Missed::none;
    Clock::duration left = Clock::duration::max();  ///< until the next one could be missed
  };

  /// `arrived`: before it was let in.
  ConnectionDeadlines(const Limits& limits, Clock::time_point arrived, Clock::time_point now)
      : limits_(limits), arrived_(arrived), last_read_(now) {}

  void on_read(Clock::time_point now) { last_read_ = now; }
  Result check(Clock::time_point now, const State& state) const;

  /// How long what was sent may go unread. `crowded`: frames fill half of the memory for them; then it is a
  /// quarter.
  static Clock::duration patience(const Limits& limits, bool crowded);

 private:
  const Limits& limits_;
  Clock::time_point arrived_, last_read_;
};

}  // namespace ecorche::server
