// SPDX-License-Identifier: Apache-2.0
#include "app/igtl/peer.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/read.hpp>
#include <utility>

#include "app/igtl/crc64.hpp"
#include "runtime/server/net/transport.hpp"

namespace ecorche::app::igtl {

namespace net = server::net;
using server::quietly;

Peer::Peer(server::tcp::socket socket, const PeerLimits& limits)
    : socket_(std::move(socket)),
      limits_(limits),
      name_(server::peer_of(socket_)),
      reading_(socket_.get_executor()),
      writing_(socket_.get_executor()),
      wake_(socket_.get_executor(), server::Clock::time_point::max()) {
  server::prepare(socket_);
}

void Peer::start(PeerEvents events) {
  events_ = std::move(events);
  net::co_spawn(
      socket_.get_executor(), [self = shared_from_this()] { return self->read(); }, net::detached);
  net::co_spawn(
      socket_.get_executor(), [self = shared_from_this()] { return self->write(); }, net::detached);
}

void Peer::offer(const Key& key, SharedBytes message) {
  waiting_[key] = std::move(message);
  wake_.cancel();
}

void Peer::offer(const Messages& messages) {
  for (const auto& [key, message] : messages) {
    if (key.type != "TDATA") waiting_[key] = message;  // it is asked for
  }
  wake_.cancel();
}

void Peer::tell(StatusOf code, const std::string& text) {
  offer({0, "STATUS", "ecorche"}, status_message("ecorche", code, text));
}

void Peer::close(const std::string& why) {
  if (!std::exchange(open_, false)) return;
  boost::system::error_code ignored;
  socket_.close(ignored);
  reading_.cancel();
  writing_.cancel();
  wake_.cancel();
  // Whoever is told may let go of this.
  const auto self = shared_from_this();
  std::exchange(events_, {}).gone(why);
}

void Peer::watch(net::steady_timer& timer) {
  timer.expires_after(server::duration(limits_.stall_seconds));
  timer.async_wait([self = shared_from_this()](const boost::system::error_code& ec) {
    if (!ec) self->close("it stood still within a message");
  });
}

net::awaitable<bool> Peer::read_all(std::span<std::byte> into) {
  boost::system::error_code ec;
  co_await net::async_read(socket_, net::buffer(into.data(), into.size()), quietly(ec));
  if (ec && open_) close(ec == net::error::eof ? "it has gone" : ec.message());
  co_return !ec && open_;
}

// False where the client is closed. gcc 12 makes no good code of co_await in a condition.
net::awaitable<bool> Peer::read_message() {
  std::array<std::byte, kHeaderBytes> head;
  bool came = co_await read_all(std::span(head).first(1));  // it may say nothing for as long as it likes
  if (!came) co_return false;
  watch(reading_);
  came = co_await read_all(std::span(head).subspan(1));
  if (!came) co_return false;
  const Header header = read_header(head);
  if (header.version != 1 && header.version != 2) {
    close("it does not speak OpenIGTLink: a header of version " + std::to_string(header.version));
    co_return false;
  }
  if (header.body_bytes > limits_.message_bytes) {
    close("a message of " + std::to_string(header.body_bytes) + " bytes, more than --max-message-bytes");
    co_return false;
  }
  Bytes body(static_cast<std::size_t>(header.body_bytes));
  came = co_await read_all(body);
  if (!came) co_return false;
  reading_.cancel();
  take(header, body);
  co_return open_;
}

void Peer::take(const Header& header, std::span<const std::byte> body) {
  if (crc64(body) != header.crc) {
    tell(StatusOf::checksum_error, header.type + ": the checksum is wrong");
  } else if (const auto content = content_of(header, body)) {
    events_.heard(header, *content);
  } else {
    tell(StatusOf::config_error, header.type + ": its extended header or metadata reach beyond it");
  }
}

net::awaitable<void> Peer::read() {
  bool more = true;
  while (more) more = co_await read_message();
}

net::awaitable<void> Peer::write_all(SharedBytes message) {
  constexpr std::size_t piece = 256 << 10;  // each in time
  for (std::size_t at = 0; open_ && at < message->size(); at += piece) {
    watch(writing_);
    boost::system::error_code ec;
    co_await net::async_write(
        socket_, net::buffer(message->data() + at, std::min(piece, message->size() - at)), quietly(ec));
    if (ec && open_) close(ec.message());
  }
  writing_.cancel();
}

net::awaitable<void> Peer::write() {
  while (open_) {
    if (waiting_.empty()) {
      boost::system::error_code ec;
      co_await wake_.async_wait(quietly(ec));
      continue;
    }
    auto next = waiting_.upper_bound(last_);
    if (next == waiting_.end()) next = waiting_.begin();
    last_ = next->first;
    const SharedBytes message = std::move(next->second);
    waiting_.erase(next);
    co_await write_all(message);
  }
}

}  // namespace ecorche::app::igtl
