// SPDX-License-Identifier: Apache-2.0
// A client that reads nothing large.
#pragma once

#include <atomic>
#include <memory>
#include <utility>

#include "tests/unit/server/forwarding_transport.hpp"

namespace ecorche::server {

// A client whose payloads never leave the server, from the `first` on; its other messages do.
class HeldTransport final : public ForwardingTransport {
 public:
  /// The first payload is the triangles of OpenModel.
  explicit HeldTransport(std::unique_ptr<Transport> inner, int first = 2, std::atomic<bool>* holds = nullptr)
      : ForwardingTransport(std::move(inner)), held_(executor()), first_(first), holds_(holds) {}

  net::awaitable<void> write(std::span<const net::const_buffer> frames,
                             boost::system::error_code& ec) override {
    if (frames.size() < 2 || ++payloads_ < first_) co_return co_await ForwardingTransport::write(frames, ec);
    if (holds_ != nullptr) *holds_ = true;
    held_.expires_at(Clock::time_point::max());
    co_await held_.async_wait(quietly(ec));
  }
  void close() override {
    ForwardingTransport::close();
    held_.cancel();
  }

 private:
  net::steady_timer held_;
  int first_;
  std::atomic<bool>* holds_;
  int payloads_ = 0;
};

}  // namespace ecorche::server
