// SPDX-License-Identifier: Apache-2.0
// Stands between the server and a client's bytes, and lets everything through.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "runtime/server/net/transport.hpp"

namespace ecorche::server {

/// What a test wants otherwise it overrides, and calls these for the rest.
class ForwardingTransport : public Transport {
 public:
  explicit ForwardingTransport(std::unique_ptr<Transport> inner) : inner_(std::move(inner)) {}

  net::any_io_executor executor() override { return inner_->executor(); }
  net::awaitable<void> open(boost::system::error_code& ec) override { return inner_->open(ec); }
  net::awaitable<std::size_t> read_some(std::span<std::byte> out, boost::system::error_code& ec) override {
    return inner_->read_some(out, ec);
  }
  net::awaitable<void> write(std::span<const net::const_buffer> frames,
                             boost::system::error_code& ec) override {
    return inner_->write(frames, ec);
  }
  net::awaitable<void> finish(boost::system::error_code& ec) override { return inner_->finish(ec); }
  void close() override { inner_->close(); }
  std::optional<Clock::time_point> moved() const override { return inner_->moved(); }
  bool hung_up() override { return inner_->hung_up(); }
  std::optional<bool> message_ended() const override { return inner_->message_ended(); }
  bool wrong_kind() const override { return inner_->wrong_kind(); }
  void ends_by(CloseReason why) override { inner_->ends_by(why); }

 private:
  std::unique_ptr<Transport> inner_;
};

}  // namespace ecorche::server
