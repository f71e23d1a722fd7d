// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/transport.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace ecorche::server {
namespace {

// Handed to the socket in one go, before others have their turn on the I/O thread: a tenth of a millisecond
// or two.
constexpr std::size_t kMostAtOnce = 512 << 10;

// The next bytes of `frame`, at most kMostAtOnce of them, in a few pieces.
class Window {
 public:
  explicit Window(std::span<const net::const_buffer> frame) : frame_(frame) { fill(); }

  std::span<const net::const_buffer> pieces() const { return std::span(pieces_).first(count_); }
  bool empty() const { return count_ == 0; }

  /// The first `n` bytes of the pieces have left.
  void advance(std::size_t n) {
    at_ += n;
    while (!frame_.empty() && at_ >= frame_.front().size()) {
      at_ -= frame_.front().size();
      frame_ = frame_.subspan(1);
    }
    fill();
  }

 private:
  void fill() {
    std::size_t room = kMostAtOnce;
    count_ = 0;
    for (std::size_t i = 0; i < frame_.size() && count_ < pieces_.size() && room > 0; ++i) {
      const net::const_buffer piece = net::buffer(frame_[i] + (i == 0 ? at_ : 0), room);
      if (piece.size() == 0) continue;
      pieces_[count_++] = piece;
      room -= piece.size();
    }
  }

  std::span<const net::const_buffer> frame_;  // what has not left yet
  std::size_t at_ = 0;                        // of its first buffer: so much has
  std::array<net::const_buffer, 64> pieces_;  // Asio takes so many
  std::size_t count_ = 0;
};

class TcpTransport final : public Transport {
 public:
  explicit TcpTransport(tcp::socket socket) : socket_(std::move(socket)) {
    boost::system::error_code ec;
    socket_.set_option(tcp::no_delay(true), ec);
    socket_.non_blocking(true, ec);  // write() waits by itself
  }

  net::any_io_executor executor() override { return socket_.get_executor(); }

  net::awaitable<void> open(boost::system::error_code& ec) override {
    ec = {};
    co_return;
  }

  net::awaitable<std::size_t> read_some(std::span<std::byte> out, boost::system::error_code& ec) override {
    co_return co_await socket_.async_read_some(net::buffer(out.data(), out.size()), quietly(ec));
  }

  // Not by Asio's async_write: it sends 64 KiB a call, and looks for news of every socket after each.
  net::awaitable<void> write(std::span<const net::const_buffer> frame,
                             boost::system::error_code& ec) override {
    Window left(frame);
    ec = {};
    while (!left.empty()) {
      const std::size_t sent = socket_.write_some(left.pieces(), ec);
      left.advance(sent);
      if (ec == net::error::would_block) {
        co_await socket_.async_wait(tcp::socket::wait_write, quietly(ec));
      } else if (!ec && !left.empty()) {
        co_await net::post(socket_.get_executor(), net::use_awaitable);
      }
      if (ec) co_return;
    }
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
