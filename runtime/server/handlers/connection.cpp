// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/handlers/connection.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/handlers/message_table.hpp"

namespace ecorche::server {
namespace {

// Bytes of one read: a client that sends its messages in smaller pieces pays for each as for a message.
constexpr std::size_t kSmallRead = 64;
// After a server that stops: until a supervisor has started it again; or, after one that was drained, at
// once, since another is there.
constexpr double kRetrySeconds = 1, kRetryElsewhere = 0.1;

}  // namespace

Connection::Connection(std::unique_ptr<Transport> transport, std::string peer,
                       std::shared_ptr<const Pass> pass, Clock::duration waited, SessionRegistry& registry)
    : transport_(std::move(transport)),
      registry_(registry),
      client_(std::make_shared<Client>(std::move(peer), std::move(pass), transport_->executor(), registry)),
      reader_({.envelope_bytes = limits().hello_bytes, .payload_bytes = 0}),
      rate_(limits().messages_per_second, std::max(1.0, limits().messages_per_second)),
      pause_(transport_->executor()),
      deadlines_(limits(), accepted_at_ - std::min(waited, duration(limits().hello_seconds / 2)),
                 accepted_at_) {}

void Connection::start() {
  client_->log(spdlog::level::debug, "connected", {});
  spawn(Part::reader, read_messages());
}

// A coroutine that ends by an exception (out of memory, most likely) ends its connection, and nothing else.
void Connection::spawn(Part part, net::awaitable<void> work) {
  const MustNotFail begins_with_asio;
  net::co_spawn(transport_->executor(), std::move(work),
                [self = shared_from_this(), part](const std::exception_ptr& failed) {
                  if (failed) self->on_failed(part);
                });
}

// The client is told, where it has what came before whole: the other part goes on, and this one begins anew,
// once, to write the last words, or to read past what is left.
void Connection::on_failed(Part part) {
  if (closed()) return;
  const bool again = std::exchange(failing_, true);
  if (again || !writer_ || (part == Part::writer && client_->output().writing())) return close("failed");
  try {
    client_->end({StatusCode::internal, "connection: the server failed at it (report it)"});
    spawn(part, part == Part::reader ? drain() : write_output());
    client_->output().wake().cancel();
  } catch (const std::exception&) {
    close("failed");
  }
}

void Connection::start_refused(const Status& status) {
  client_->end(status);
  start();
}

void Connection::say_goodbye(const Status& status) {
  v1::Envelope last;
  wire::to_proto(status, *last.mutable_goodbye()->mutable_status());
  const Options& options = registry_.options();
  const bool replaced = options.drain_seconds > 0 || !options.elsewhere.empty();
  last.mutable_goodbye()->set_retry_seconds(replaced ? kRetryElsewhere : kRetrySeconds);
  last.mutable_goodbye()->set_elsewhere(options.elsewhere);
  client_->end(std::move(last), farewell_of(status.code));
}

void Connection::check_pass() {
  if (closed()) return;
  client_->guard("connection: the server failed at it (report it)", [&] { client_->check_pass(); });
  set_rate();
}

// The rate of its token, where that has one.
void Connection::set_rate() {
  const auto& pass = client_->pass();
  const double rate =
      pass && pass->messages_per_second ? *pass->messages_per_second : limits().messages_per_second;
  rate_ = Rate(rate, std::max(1.0, rate));
}

void Connection::close(const char* why) {
  if (closed()) return;
  const MustNotFail half_way;
  client_->log(spdlog::level::debug, "closed: ", why);
  transport_->close();
  pause_.cancel();
  client_->on_closed();
}

void Connection::evict(bool tell) {
  if (tell && opened_) {
    return client_->end_at("hello",
                           {StatusCode::resource_exhausted,
                            "hello: none came, and another client took the place (send it at once)"});
  }
  registry_.metrics().hit("hello");
  close("evicted");
}

std::uint64_t Connection::unread(Clock::time_point now, Clock::duration patience) const {
  return closed() ? 0 : client_->output().unread(now, transport_->moved(), patience);
}

void Connection::drop_unread() {
  client_->log(spdlog::level::info, "dropped: read nothing while others waited for room", {});
  registry_.metrics().hit("room");
  close("made room");
}

// Where frames crowd the memory it is not enough that something moves.
Clock::duration Connection::check(Clock::time_point now) {
  if (closed()) return Clock::duration::max();
  if (const char* const why = client_->aborted()) {
    close(why);
    return Clock::duration::max();
  }
  const bool crowded = registry_.crowded(now);
  const auto patience = ConnectionDeadlines::patience(limits(), crowded);
  const auto [missed, left] =
      deadlines_.check(now, {.opened = opened_,
                             .greeted = client_->greeted(),
                             .ending_since = client_->ending_since(),
                             .stalls_at = client_->output().stalls_at(transport_->moved(), patience, crowded),
                             .unfinished_since = reader_.unfinished_since()});
  on_missed(missed);
  return left;
}

void Connection::on_missed(ConnectionDeadlines::Missed deadline) {
  using Missed = ConnectionDeadlines::Missed;
  switch (deadline) {
    case Missed::none:
      return;
    case Missed::last_words:
      return close("last words not read");
    case Missed::handshake:
      registry_.metrics().hit("hello");
      return close("no handshake");  // nothing can be said yet
    case Missed::hello:
      return client_->end_at(
          "hello", {StatusCode::deadline_exceeded,
                    "hello: none within " + std::to_string(limits().hello_seconds) + " s (send it first)"});
    case Missed::stall:
      return on_stalled();
    case Missed::half_message:
      return client_->end_at("stall", {StatusCode::deadline_exceeded,
                                       "frame: half a message, then nothing (send whole messages)"});
    case Missed::idle:
      return client_->end_at(
          "idle", {StatusCode::deadline_exceeded, "connection: nothing heard (send a Ping now and then)"});
  }
}

// Who takes nothing of a write can be told nothing. What else waits for it would only keep it from its last
// words.
void Connection::on_stalled() {
  if (client_->output().writing()) {
    client_->log(spdlog::level::info, "dropped: stopped reading", {});
    registry_.metrics().hit("stall");
    return close("stalled");
  }
  registry_.executor().destroy_later(client_->output().clear());
  client_->end_at("stall",
                  {StatusCode::deadline_exceeded,
                   "frame: none was acknowledged in time (send FrameAck for each as soon as it is read)"});
}

net::awaitable<bool> Connection::open_transport() {
  boost::system::error_code ec;
  co_await transport_->open(ec);
  if (ec && !closed()) client_->log(spdlog::level::debug, "", ec.message());
  opened_ = !ec;
  co_return opened_ && !closed();
}

net::awaitable<void> Connection::read_messages() {
  const auto self = shared_from_this();
  const bool opened = co_await open_transport();
  if (!opened) {
    close("no handshake");
    co_return;
  }
  spawn(Part::writer, write_output());
  writer_ = true;
  boost::system::error_code ec;
  while (!client_->over()) {
    const std::size_t n = co_await transport_->read_some(reader_.buffer(), ec);
    if (ec) {
      close("client left");
      co_return;
    }
    on_read(n);
    while (!client_->over() && handle_next()) co_await throttle();
    if (n < kSmallRead && !reader_.between_frames()) co_await throttle();
  }
  co_await drain();
}

void Connection::on_read(std::size_t n) {
  const auto now = Clock::now();
  deadlines_.on_read(now);
  registry_.metrics().read(n);
  reader_.on_read(n, now, transport_->message_ended());
  if (transport_->wrong_kind()) {
    client_->end({StatusCode::invalid_argument, "message: it is text (send binary ones, a frame each)"},
                 CloseReason::wrong_kind);
  }
}

bool Connection::handle_next() {
  bool handled = false;
  client_->guard("message: the server failed at it (report it)", [&] {
    std::optional<wire::Frame> message;
    if (const Status status = reader_.next(message); !status.ok()) {
      registry_.metrics().hit("frame");
      const bool large = status.code == StatusCode::resource_exhausted;
      return client_->end(status, large ? CloseReason::too_big : farewell_of(status.code));
    }
    if (!message) return;
    handled = true;
    const bool greeted = client_->greeted();
    dispatch(*client_, *message);
    if (!greeted && client_->greeted()) {
      reader_.set_limits(
          {.envelope_bytes = limits().envelope_bytes, .payload_bytes = limits().payload_bytes});
      set_rate();
    }
    if (client_->aborted()) close(client_->aborted());
  });
  return handled;
}

net::awaitable<void> Connection::throttle() {
  boost::system::error_code ec;
  bool taken = false, counted = false;
  while (!client_->over()) {
    // Nothing is read meanwhile, which would tell; and who has gone must not take its place, to which it may
    // come back.
    if (client_->resuming() && transport_->hung_up()) co_return close("client left");
    taken = taken || rate_.take(Clock::now());
    if (!client_->resuming()) {
      if (taken && client_->output().takes_answers()) co_return;
      if (!std::exchange(counted, true)) registry_.metrics().hit("rate");
    }
    pause_.expires_after(std::chrono::milliseconds(5));
    co_await registry_.wait(pause_, ec);
  }
}

// Closing a socket with unread bytes resets the connection, and the client would lose the last words.
net::awaitable<void> Connection::drain() {
  std::array<std::byte, 4096> bytes{};
  boost::system::error_code ec;
  while (!closed() && !ec) co_await transport_->read_some(bytes, ec);
  close("client left");
}

net::awaitable<void> Connection::write_output() {
  const auto self = shared_from_this();
  boost::system::error_code ec;
  ClientOutput& output = client_->output();
  while (!closed()) {
    const ClientOutput::Write* const write = output.next(Clock::now(), transport_->joins_frames());
    if (!write && output.finished_by()) {
      transport_->ends_by(*output.finished_by());
      co_await transport_->finish(ec);
      co_return;
    }
    if (!write) {
      output.wake().expires_at(Clock::time_point::max());
      co_await registry_.wait(output.wake(), ec);
      continue;
    }
    co_await transport_->write(write->buffers, ec);
    if (ec) {
      registry_.executor().destroy_later(output.failed());
      close("client left");
      co_return;
    }
    output.written(Clock::now());
    if (const auto& session = client_->session()) session->has_read();
  }
}

}  // namespace ecorche::server
