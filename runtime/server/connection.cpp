// SPDX-License-Identifier: Apache-2.0
// Sockets, deadlines and the end of a connection; what its messages do stands in commands.cpp.
#include "runtime/server/connection.hpp"

#include <spdlog/spdlog.h>

#include <array>
#include <utility>

#include "proto/convert.hpp"

namespace ecorche::server {
namespace {

// Answers that may wait before the client has to read some.
constexpr std::size_t kMostAnswers = 64;
// How long an ending connection may take to read its last words.
constexpr double kLastWordsSeconds = 1;

}  // namespace

Connection::Connection(tcp::socket socket, House& house)
    : socket_(std::move(socket)),
      house_(house),
      reader_({.envelope_bytes = house.limits().hello_bytes, .payload_bytes = 0}),
      outbox_(house.limits().frames_in_flight),
      wake_(socket_.get_executor()),
      pause_(socket_.get_executor()),
      allowance_(house.limits().messages_per_second),
      allowance_at_(Clock::now()) {
  boost::system::error_code ec;
  socket_.set_option(tcp::no_delay(true), ec);
  const tcp::endpoint peer = socket_.remote_endpoint(ec);
  peer_ = ec ? "?" : peer.address().to_string() + ":" + std::to_string(peer.port());
}

Connection::~Connection() = default;

void Connection::start() {
  spdlog::debug("{}: connected", peer_);
  const auto spawn = [&](net::awaitable<void> work) {
    net::co_spawn(socket_.get_executor(), std::move(work), net::detached);
  };
  spawn(read_frames());
  spawn(write_frames());
}

void Connection::start_refused(const Status& status) {
  end(status);
  start();
}

void Connection::say_goodbye(const Status& status) {
  v1::Envelope last;
  wire::to_proto(status, *last.mutable_goodbye()->mutable_status());
  end(std::move(last));
}

void Connection::end(const Status& status) {
  spdlog::info("{}: ended: {}", peer_, status.message);
  v1::Envelope last;
  wire::to_proto(status, *last.mutable_status());
  end(std::move(last));
}

void Connection::end(v1::Envelope last) {
  if (std::exchange(ending_, true)) return;
  ending_since_ = Clock::now();
  answer(0, std::move(last));
}

void Connection::close(const char* why) {
  if (std::exchange(closed_, true)) return;
  spdlog::debug("{}: closed: {}", peer_, why);
  if (const auto session = std::exchange(session_, nullptr)) session->leave(*this);
  boost::system::error_code ec;
  socket_.close(ec);
  wake_.cancel();
  pause_.cancel();
}

void Connection::check(Clock::time_point now) {
  const Limits& limits = house_.limits();
  const auto longer = [&](std::optional<Clock::time_point> since, double seconds) {
    return since && now - *since > duration(seconds);
  };
  if (closed_) return;
  if (ending_) {
    if (longer(ending_since_, kLastWordsSeconds)) close("last words not read");
  } else if (!greeted_ && longer(born_, limits.hello_seconds)) {
    end({StatusCode::deadline_exceeded,
         "hello: none within " + std::to_string(limits.hello_seconds) + " s (send it first)"});
  } else if (longer(writing_since_, limits.stall_seconds) ||
             longer(outbox_.oldest_in_flight(), limits.stall_seconds)) {
    spdlog::info("{}: dropped: stopped reading", peer_);
    close("stalled");
  } else if (longer(reading_since_, limits.stall_seconds)) {
    end({StatusCode::deadline_exceeded, "frame: half a message, then nothing (send whole messages)"});
  } else if (longer(heard_, limits.idle_seconds)) {
    end({StatusCode::deadline_exceeded, "connection: nothing heard (send a Ping now and then)"});
  }
}

net::awaitable<void> Connection::read_frames() {
  const auto self = shared_from_this();
  boost::system::error_code ec;
  while (!closed_ && !ending_) {
    const std::size_t n = co_await socket_.async_read_some(
        net::buffer(reader_.want().data(), reader_.want().size()), quietly(ec));
    if (ec) {
      close("client left");
      co_return;
    }
    take_in(n);
    if (reader_.between_frames()) co_await hold_back();
  }
  co_await discard();
}

void Connection::take_in(std::size_t n) {
  if (ending_) return;  // said goodbye meanwhile
  heard_ = Clock::now();
  if (reader_.between_frames()) reading_since_ = heard_;
  try {
    if (const Status status = reader_.advance(n); !status.ok()) return end(status);
    if (!reader_.complete()) return;
    reading_since_.reset();
    handle(reader_.take());
  } catch (const std::exception& error) {
    spdlog::error("{}: {}", peer_, error.what());
    end({StatusCode::internal, "message: the server failed at it (report it)"});
  }
}

net::awaitable<void> Connection::hold_back() {
  const double rate = house_.limits().messages_per_second;
  boost::system::error_code ec;
  allowance_ -= 1;
  while (!closed_ && !ending_) {
    const auto now = Clock::now();
    // At most a second's worth in one go.
    allowance_ =
        std::min(rate, allowance_ + rate * std::chrono::duration<double>(now - allowance_at_).count());
    allowance_at_ = now;
    if (allowance_ >= 0 && outbox_.answers() <= kMostAnswers) co_return;
    pause_.expires_after(std::chrono::milliseconds(5));
    co_await pause_.async_wait(quietly(ec));
  }
}

// Closing a socket with unread bytes resets the connection, and the client would lose the last words: read
// until it hangs up.
net::awaitable<void> Connection::discard() {
  std::array<std::byte, 4096> bytes{};
  boost::system::error_code ec;
  while (!closed_ && !ec) co_await socket_.async_read_some(net::buffer(bytes), quietly(ec));
  close("client left");
}

net::awaitable<void> Connection::write_frames() {
  const auto self = shared_from_this();
  boost::system::error_code ec;
  while (!closed_) {
    const SharedFrame frame = outbox_.next(Clock::now());
    if (!frame && ending_) {
      socket_.shutdown(tcp::socket::shutdown_send, ec);
      co_return;
    }
    if (!frame) {
      wake_.expires_at(Clock::time_point::max());
      co_await wake_.async_wait(quietly(ec));
      continue;
    }
    std::array<net::const_buffer, 2> buffers{net::buffer(frame->head), net::const_buffer()};
    if (frame->payload) buffers[1] = net::buffer(*frame->payload);
    writing_since_ = Clock::now();
    co_await net::async_write(socket_, buffers, quietly(ec));
    writing_since_.reset();
    if (ec) close("client left");
  }
}

void Connection::deliver(const PosedFrame& frame) {
  if (closed_ || ending_) return;
  outbox_.offer(frame.subscription, frame.number, frame.bytes);
  wake_.cancel();
}

void Connection::answer(std::uint64_t request_id, v1::Envelope envelope,
                        std::shared_ptr<const wire::Payload> payload) {
  envelope.set_request_id(request_id);
  outbox_.answer(wire::encode(envelope, std::move(payload)));
  wake_.cancel();
}

void Connection::answer_status(std::uint64_t request_id, const Status& status) {
  v1::Envelope envelope;
  wire::to_proto(status, *envelope.mutable_status());
  answer(request_id, std::move(envelope));
}

}  // namespace ecorche::server
