// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/net/transport.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/platform/socket_options.hpp"
#include "runtime/server/net/write_turn.hpp"

namespace ecorche::server {
namespace {

// What the kernel keeps for a client that does not read, besides what is on its way: more is of no use to
// anybody, and 32 clients that come and stop reading would have it clear 200 MB at once.
constexpr int kMostUnsent = 1 << 20;

// What of `frame` has not left yet.
class Window {
 public:
  explicit Window(std::span<const net::const_buffer> frame) : frame_(frame) { advance(0); }

  bool empty() const { return frame_.empty(); }

  /// At most `most` bytes of it, in a few pieces; good until the next call.
  std::span<const net::const_buffer> next(std::size_t most) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < frame_.size() && count < pieces_.size() && most > 0; ++i) {
      const net::const_buffer piece = net::buffer(frame_[i] + (i == 0 ? at_ : 0), most);
      if (piece.size() == 0) continue;
      pieces_[count++] = piece;
      most -= piece.size();
    }
    return std::span(pieces_).first(count);
  }

  /// The first `n` bytes of it have left.
  void advance(std::size_t n) {
    at_ += n;
    while (!frame_.empty() && at_ >= frame_.front().size()) {
      at_ -= frame_.front().size();
      frame_ = frame_.subspan(1);
    }
  }

 private:
  std::span<const net::const_buffer> frame_;
  std::size_t at_ = 0;                        // of its first buffer: so much has left
  std::array<net::const_buffer, 64> pieces_;  // Asio takes so many
};

class TcpTransport final : public Transport {
 public:
  explicit TcpTransport(tcp::socket socket) : socket_(std::move(socket)) {
    prepare(socket_);
    boost::system::error_code ec;
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
    WriteTurn turn(socket_.get_executor());
    ec = {};
    while (!left.empty()) {
      const std::size_t sent = socket_.write_some(left.next(WriteTurn::allowance()), ec);
      left.advance(sent);
      if (sent > 0) moved_ = Clock::now();
      if (ec == net::error::would_block) {
        co_await socket_.async_wait(tcp::socket::wait_write, quietly(ec));
      } else if (!ec && !left.empty()) {
        co_await turn.next();
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

  std::optional<Clock::time_point> moved() const override { return moved_; }
  bool hung_up() override { return server::hung_up(socket_); }

 private:
  tcp::socket socket_;
  std::optional<Clock::time_point> moved_;
};

}  // namespace

std::unique_ptr<Transport> tcp_transport(tcp::socket socket) {
  return std::make_unique<TcpTransport>(std::move(socket));
}

// Over a network that loses packets now and then, whoever takes each loss for a full line, as the usual ways
// of TCP do, sends next to nothing. Where the system does not have BBR, or keeps it for itself, things stay
// as they are.
void prefer_bbr(tcp::socket& socket) {
  boost::system::error_code ec;
  const tcp::endpoint peer = socket.remote_endpoint(ec);
  if (!ec && !peer.address().is_loopback()) platform::prefer_bbr(socket.native_handle());
}

void prepare(tcp::socket& socket) {
  boost::system::error_code ec;
  prefer_bbr(socket);
  socket.set_option(tcp::no_delay(true), ec);
  platform::limit_unsent(socket.native_handle(), kMostUnsent);
}

std::string peer_of(const tcp::socket& socket) {
  boost::system::error_code ec;
  const tcp::endpoint peer = socket.remote_endpoint(ec);
  return ec ? "?" : peer.address().to_string() + ":" + std::to_string(peer.port());
}

bool hung_up(tcp::socket& socket) {
  return platform::has_hung_up(socket.native_handle());
}

Clock::duration waited(tcp::socket& socket) {
  return platform::since_received(socket.native_handle());
}

}  // namespace ecorche::server
