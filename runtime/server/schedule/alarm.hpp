// SPDX-License-Identifier: Apache-2.0
// A time at which something is due.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

/// Calls `ring` at its time, and never once it is gone. On the I/O thread.
class Alarm {
 public:
  Alarm(net::io_context& io, std::function<void()> ring)
      : state_(std::make_shared<State>(io, std::move(ring))) {}

  /// The next time, in place of the one before; nothing: none. Throws bad_alloc, and is set to nothing then.
  void set(std::optional<Clock::time_point> at) {
    if (at == state_->at) return;
    state_->at.reset();
    if (!at) {
      state_->timer.cancel();
      return;
    }
    state_->timer.expires_at(*at);
    state_->timer.async_wait([weak = std::weak_ptr<State>(state_)](const boost::system::error_code& ec) {
      const auto state = weak.lock();
      if (!state || ec) return;
      state->at.reset();
      state->ring();
    });
    state_->at = at;
  }

 private:
  struct State {
    State(net::io_context& io, std::function<void()> call) : timer(io), ring(std::move(call)) {}
    net::steady_timer timer;
    std::function<void()> ring;
    std::optional<Clock::time_point> at;
  };
  std::shared_ptr<State> state_;
};

}  // namespace ecorche::server
