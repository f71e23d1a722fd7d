// SPDX-License-Identifier: Apache-2.0
// What never fails, made to fail once: the Nth time from now.
#pragma once

#include <atomic>
#include <memory>
#include <utility>

#include "tests/unit/server/forwarding_transport.hpp"

namespace ecorche::server {

/// From any thread.
class Countdown {
 public:
  /// The `n`th call of strikes() from now is true, counted from 0.
  void set(int n) { left_ = n; }
  void off() { left_ = -1; }
  bool strikes() { return left_.load() >= 0 && left_.fetch_sub(1) == 0; }
  /// It struck, or was off.
  bool spent() const { return left_.load() < 0; }

 private:
  std::atomic<int> left_{-1};
};

/// A transport whose reads and writes break when the countdowns strike, as a connection does that is reset.
class FaultyTransport final : public ForwardingTransport {
 public:
  FaultyTransport(std::unique_ptr<Transport> inner, Countdown& reads, Countdown& writes)
      : ForwardingTransport(std::move(inner)), reads_(reads), writes_(writes) {}

  net::awaitable<std::size_t> read_some(std::span<std::byte> out, boost::system::error_code& ec) override {
    if (!reads_.strikes()) co_return co_await ForwardingTransport::read_some(out, ec);
    ec = net::error::connection_reset;
    co_return 0;
  }
  net::awaitable<void> write(std::span<const net::const_buffer> frame,
                             boost::system::error_code& ec) override {
    if (writes_.strikes())
      ec = net::error::broken_pipe;
    else
      co_await ForwardingTransport::write(frame, ec);
  }

 private:
  Countdown& reads_;
  Countdown& writes_;
};

}  // namespace ecorche::server
