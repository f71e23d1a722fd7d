// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/transport.hpp"

#include <utility>

namespace ecorche::server {
namespace {

class TcpTransport final : public Transport {
 public:
  explicit TcpTransport(tcp::socket socket) : socket_(std::move(socket)) {
    boost::system::error_code ec;
    socket_.set_option(tcp::no_delay(true), ec);
  }

  net::any_io_executor executor() override { return socket_.get_executor(); }

  net::awaitable<void> open(boost::system::error_code& ec) override {
    ec = {};
    co_return;
  }

  net::awaitable<std::size_t> read_some(std::span<std::byte> out, boost::system::error_code& ec) override {
    co_return co_await socket_.async_read_some(net::buffer(out.data(), out.size()), quietly(ec));
  }

  net::awaitable<void> write(std::span<const net::const_buffer> frame,
                             boost::system::error_code& ec) override {
    co_await net::async_write(socket_, frame, quietly(ec));
  }

  net::awaitable<void> finish(boost::system::error_code& ec) override {
    socket_.shutdown(tcp::socket::shutdown_send, ec);
    co_return;
  }

  void close() override {
    boost::system::error_code ec;
    socket_.close(ec);
  }

 private:
  tcp::socket socket_;
};

}  // namespace

std::unique_ptr<Transport> tcp_transport(tcp::socket socket) {
  return std::make_unique<TcpTransport>(std::move(socket));
}

std::string peer_of(const tcp::socket& socket) {
  boost::system::error_code ec;
  const tcp::endpoint peer = socket.remote_endpoint(ec);
  return ec ? "?" : peer.address().to_string() + ":" + std::to_string(peer.port());
}

}  // namespace ecorche::server
