// SPDX-License-Identifier: Apache-2.0
// Bytes in and out, deadlines and the end of a connection; what its messages do stands in commands.cpp.
#include "runtime/server/handlers/connection.hpp"

#include <algorithm>
#include <array>
#include <new>
#include <utility>
#include <vector>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/resources/reserve.hpp"
#include "runtime/server/resources/shares.hpp"

namespace ecorche::server {
namespace {

// Answers that may wait before the client has to read some.
constexpr std::size_t kMostAnswers = 64;
constexpr std::uint64_t kMostAnswerBytes = 64 << 20;
// Frames of one write.
constexpr std::size_t kMostTogether = 16;
// Of one read: a client that sends its messages in smaller pieces pays for each as for a message.
constexpr std::size_t kLittle = 64;
// Of the time until a client is dropped that acknowledges nothing, where frames fill half of the memory for
// them.
constexpr double kLessPatience = 0.25;
// How long an ending connection may take to read its last words.
constexpr double kLastWordsSeconds = 1;
// After a server that stops: until a supervisor has started it again.
constexpr double kRetrySeconds = 1;

}  // namespace

Connection::Connection(std::unique_ptr<Transport> transport, const std::string& peer, bool proven,
                       Clock::duration waited, SessionRegistry& registry)
    : transport_(std::move(transport)),
      registry_(registry),
      reader_({.envelope_bytes = registry.limits().hello_bytes, .payload_bytes = 0}),
      outbox_(registry.limits().frames_in_flight),
      wake_(transport_->executor()),
      pause_(transport_->executor()),
      number_(registry.next_connection()),
      peer_("#" + std::to_string(number_) + " " + peer),
      address_(address_of(peer)),
      portion_(std::make_shared<const Pool>(
          portion(registry.limits().kept_bytes, registry.limits().connection_share),
          registry.share_of(address_)->kept)),
      account_(std::make_shared<Account>(registry.share_of(address_)->account)),
      proven_(proven),
      allowance_(registry.limits().messages_per_second),
      allowance_at_(Clock::now()),
      came_(born_ - std::min(waited, duration(registry.limits().hello_seconds / 2))) {}

Connection::~Connection() = default;

// Says nothing where there is no memory for it.
void Connection::log(spdlog::level::level_enum level, std::string_view what,
                     std::string_view why) const noexcept {
  try {
    registry_.journal().line(level, address_, peer_, std::string(what).append(why));
  } catch (const std::exception&) {
  }
}

void Connection::start() {
  log(spdlog::level::debug, "connected", {});
  spawn(Part::reader, read_frames());
}

// A coroutine that ends by an exception (out of memory, most likely) ends its connection, and nothing else.
void Connection::spawn(Part part, net::awaitable<void> work) {
  const MustNotFail begins_with_asio;
  net::co_spawn(transport_->executor(), std::move(work),
                [self = shared_from_this(), part](const std::exception_ptr& failed) {
                  if (failed) self->failed(part);
                });
}

// The client is told, where it has what came before whole: the other part goes on, and this one begins anew,
// once, to write the last words, or to read past what is left.
void Connection::failed(Part part) {
  if (closed_) return;
  const bool again = std::exchange(failing_, true);
  if (again || !writer_ || (part == Part::writer && writing_)) return close("failed");
  try {
    end({StatusCode::internal, "connection: the server failed at it (report it)"});
    spawn(part, part == Part::reader ? discard() : write_frames());
    wake_.cancel();
  } catch (const std::exception&) {
    close("failed");
  }
}

void Connection::start_refused(const Status& status) {
  end(status);
  start();
}

void Connection::say_goodbye(const Status& status) {
  v1::Envelope last;
  wire::to_proto(status, *last.mutable_goodbye()->mutable_status());
  last.mutable_goodbye()->set_retry_seconds(kRetrySeconds);
  end(std::move(last), farewell_of(status.code));
}

void Connection::make_way(bool told) {
  if (told && open_) {
    return hit("hello", {StatusCode::resource_exhausted,
                         "hello: none came, and another client took the place (send it at once)"});
  }
  registry_.metrics().hit("hello");
  close("made way");
}

void Connection::end(const Status& status) {
  end(status, farewell_of(status.code));
}

void Connection::end(const Status& status, CloseReason why) {
  log(spdlog::level::info, "ended: ", status.message);
  v1::Envelope last;
  wire::to_proto(status, *last.mutable_status());
  end(std::move(last), why);
}

void Connection::end(v1::Envelope last, CloseReason why) {
  if (ending_) return;
  answer(0, std::move(last));
  transport_->ends_by(why);
  ending_ = true;
  ending_since_ = Clock::now();
}

void Connection::close(const char* why) {
  if (std::exchange(closed_, true)) return;
  const MustNotFail half_way;
  log(spdlog::level::debug, "closed: ", why);
  transport_->close();
  wake_.cancel();
  pause_.cancel();
  leave_place();
  try {
    registry_.executor().destroy_later(outbox_.clear());
  } catch (const std::bad_alloc&) {  // then it goes with the connection
  }
}

// One who said goodbye does not come back.
void Connection::leave_place() {
  const auto session = std::exchange(session_, nullptr);
  std::optional<SavedPlace> place;
  if (session && !departed_ && !session->retired()) {
    try {
      place = SavedPlace{.session = session,
                         .asked = session->subscriptions().requests_of(*this),
                         .controlled = session->control().controls(*this)};
    } catch (const std::bad_alloc&) {  // then nobody comes back to it
    }
  }
  if (session) session->leave(*this, place.has_value());
  registry_.left(resume_token_, std::move(place));
}

void Connection::give_up() {
  const MustNotFail half_way;
  try {
    registry_.executor().destroy_later(outbox_.clear());
    end({StatusCode::aborted,
         "resume: another connection showed this one's token, and has its place (go on there)"});
  } catch (const std::bad_alloc&) {
    return close("its place was taken up again");
  }
  leave_place();
}

void Connection::told(const std::function<void()>& tell) noexcept {
  try {
    tell();
  } catch (const std::exception&) {
    failed_ = true;
  }
}

Clock::duration Connection::check(Clock::time_point now) {
  const Limits& limits = registry_.limits();
  Clock::duration left = Clock::duration::max();
  const auto reached = [&](std::optional<Clock::time_point> when) {
    if (!when) return false;
    if (now >= *when) return true;
    left = std::min(left, *when - now);
    return false;
  };
  const auto longer = [&](std::optional<Clock::time_point> since, double seconds) {
    return since && reached(*since + duration(seconds));
  };
  if (closed_) return left;
  if (failed_) {
    close("no memory for what it was to be told");
  } else if (ending_) {
    if (longer(ending_since_, kLastWordsSeconds)) close("last words not read");
  } else if (!open_ && longer(came_, limits.hello_seconds)) {
    registry_.metrics().hit("hello");
    close("no handshake");  // nothing can be said yet
  } else if (!greeted_ && longer(came_, limits.hello_seconds)) {
    hit("hello", {StatusCode::deadline_exceeded,
                  "hello: none within " + std::to_string(limits.hello_seconds) + " s (send it first)"});
  } else if (reached(stalls_at(now))) {
    stalled();
  } else if (longer(reading_since_, limits.stall_seconds)) {
    hit("stall",
        {StatusCode::deadline_exceeded, "frame: half a message, then nothing (send whole messages)"});
  } else if (longer(heard_, limits.idle_seconds)) {
    hit("idle", {StatusCode::deadline_exceeded, "connection: nothing heard (send a Ping now and then)"});
  }
  return left;
}

// When what was sent counts as stalled, should no more be read or acknowledged until then. Where frames crowd
// the memory it is not enough that something moves.
std::optional<Clock::time_point> Connection::stalls_at(Clock::time_point now) const {
  const bool crowded = registry_.crowded(now);
  const auto patience = duration(registry_.limits().stall_seconds * (crowded ? kLessPatience : 1));
  std::optional<Clock::time_point> at;
  if (writing_) at = stalled_at(*writing_, transport_->moved(), patience, crowded);
  if (const auto since = crowded ? outbox_.oldest_in_flight() : outbox_.oldest_written())
    at = std::min(at.value_or(Clock::time_point::max()), *since + patience);
  return at;
}

// Who takes nothing of a write can be told nothing. What else waits for it would only keep it from its last
// words.
void Connection::stalled() {
  if (writing_) {
    log(spdlog::level::info, "dropped: stopped reading", {});
    registry_.metrics().hit("stall");
    return close("stalled");
  }
  registry_.executor().destroy_later(outbox_.clear());
  hit("stall", {StatusCode::deadline_exceeded,
                "frame: none was acknowledged in time (send FrameAck for each as soon as it is read)"});
}

std::uint64_t Connection::clogged(Clock::time_point now, Clock::duration patience) const {
  if (closed_ || (!writing_ && !outbox_.oldest_written())) return 0;
  const Clock::time_point since =
      writing_ ? std::max(writing_->since, transport_->moved().value_or(writing_->since))
               : *outbox_.oldest_written();
  return now - since < patience ? 0 : held();
}

std::uint64_t Connection::held() const {
  return outbox_.bytes() + (writing_ ? writing_->bytes : 0);
}

void Connection::make_room() {
  log(spdlog::level::info, "dropped: read nothing while others waited for room", {});
  registry_.metrics().hit("room");
  close("made room");
}

// Within its share; who reads may have another frame made while the last one is written, however large they
// are. Where all memory is taken, only of what has been read.
bool Connection::may_take(std::uint32_t subscription, std::uint64_t bytes) {
  const std::uint64_t waits = held();
  if (waits == 0) return true;
  const MemoryBudget& memory = registry_.memory();
  if (!memory.small(bytes) && memory.full(bytes)) return false;
  if (waits + bytes <= portion(memory.limit(), registry_.limits().connection_share)) return true;
  return waits <= bytes && outbox_.arrives(subscription);
}

void Connection::hit(const char* limit, const Status& status) {
  registry_.metrics().hit(limit);
  end(status);
}

net::awaitable<bool> Connection::open_transport() {
  boost::system::error_code ec;
  co_await transport_->open(ec);
  if (ec && !closed_) log(spdlog::level::debug, "", ec.message());
  open_ = !ec;
  co_return open_ && !closed_;
}

net::awaitable<void> Connection::read_frames() {
  const auto self = shared_from_this();
  const bool opened = co_await open_transport();
  if (!opened) {
    close("no handshake");
    co_return;
  }
  spawn(Part::writer, write_frames());
  writer_ = true;
  boost::system::error_code ec;
  while (!closed_ && !ending_) {
    // What is long goes where it stays.
    const std::span<std::byte> spec = reader_.want();
    const bool direct = spec.size() >= inbox_.size();
    const std::size_t n = co_await transport_->read_some(direct ? spec : std::span<std::byte>(inbox_), ec);
    if (ec) {
      close("client left");
      co_return;
    }
    heard_ = Clock::now();
    registry_.metrics().read(n);
    if (transport_->wrong_kind()) {
      end({StatusCode::invalid_argument, "message: it is text (send binary ones, a frame each)"},
          CloseReason::wrong_kind);
      break;
    }
    const bool trickles = n < kLittle;
    if (!direct && n > 0) {
      co_await take_apart(std::span<const std::byte>(inbox_).first(n));
    } else {
      take_in(n, true);
      if (reader_.between_frames()) co_await hold_back();
    }
    if (trickles && !reader_.between_frames()) co_await hold_back();
  }
  co_await discard();
}

net::awaitable<void> Connection::take_apart(std::span<const std::byte> bytes) {
  while (!bytes.empty() && !closed_ && !ending_) {
    const std::span<std::byte> spec = reader_.want();
    const std::size_t n = std::min(spec.size(), bytes.size());
    std::copy_n(bytes.begin(), n, spec.begin());
    bytes = bytes.subspan(n);
    take_in(n, bytes.empty());
    if (reader_.between_frames()) co_await hold_back();
  }
}

void Connection::take_in(std::size_t n, bool last) {
  if (ending_) return;  // said goodbye meanwhile
  if (reader_.between_frames()) reading_since_ = heard_;
  const HandlingScope handling(registry_.hooks());
  const MayFail may_fail;
  try {
    if (const Status status = reader_.advance(n); !status.ok()) {
      registry_.metrics().hit("frame");
      const bool large = status.code == StatusCode::resource_exhausted;
      return end(status, large ? CloseReason::too_big : farewell_of(status.code));
    }
    if (const auto ended = transport_->message_ended(); ended && (last && *ended) != reader_.complete()) {
      return end({StatusCode::invalid_argument,
                  "message: it holds more or less than one frame (send one frame a message)"});
    }
    if (!reader_.complete()) return;
    reading_since_.reset();
    handle(reader_.take());
  } catch (const std::exception& error) {
    fail("message: the server failed at it (report it)", error);
  }
}

void Connection::take_back(const std::function<void()>& answer) {
  const HandlingScope handling(registry_.hooks());
  const MayFail may_fail;
  try {
    answer();
  } catch (const std::exception& error) {
    fail("answer: the server failed at it (report it)", error);
  }
}

void Connection::fail(const char* what, const std::exception& error) noexcept {
  const MustNotFail last_words;
  log(spdlog::level::err, "failed: ", error.what());
  told([&] { end({StatusCode::internal, what}); });
}

net::awaitable<void> Connection::hold_back() {
  const double rate = registry_.limits().messages_per_second;
  boost::system::error_code ec;
  bool held = false;
  allowance_ -= 1;
  while (!closed_ && !ending_) {
    // Nothing is read meanwhile, which would tell; and who has gone must not take its place, to which it may
    // come back.
    if (returning_ && transport_->hung_up()) co_return close("client left");
    const auto now = Clock::now();
    // At most a second's worth in one go.
    allowance_ =
        std::min(rate, allowance_ + rate * std::chrono::duration<double>(now - allowance_at_).count());
    allowance_at_ = now;
    const bool few = outbox_.answers() <= kMostAnswers && outbox_.answer_bytes() <= kMostAnswerBytes;
    if (!returning_ && allowance_ >= 0 && few) co_return;
    if (!returning_ && !std::exchange(held, true)) registry_.metrics().hit("rate");
    pause_.expires_after(std::chrono::milliseconds(5));
    co_await registry_.wait(pause_, ec);
  }
}

// Closing a socket with unread bytes resets the connection, and the client would lose the last words: read
// until it hangs up.
net::awaitable<void> Connection::discard() {
  std::array<std::byte, 4096> bytes{};
  boost::system::error_code ec;
  while (!closed_ && !ec) co_await transport_->read_some(bytes, ec);
  close("client left");
}

net::awaitable<void> Connection::write_frames() {
  const auto self = shared_from_this();
  boost::system::error_code ec;
  std::vector<SharedFrame> frames;  // of one write: answers, and then at most one of a subscription
  std::vector<net::const_buffer> buffers;
  while (!closed_) {
    frames.clear();
    buffers.clear();
    const auto start = Clock::now();
    bool posed = false;
    while (frames.size() < kMostTogether && !posed) {
      if (ending_ && outbox_.answers() == 0) break;  // nothing comes after the last words
      SharedFrame frame = outbox_.next(start);
      if (!frame) break;
      posed = outbox_.last_was_posed();
      buffers.push_back(net::buffer(frame->head));
      if (frame->payload) buffers.push_back(net::buffer(*frame->payload));
      for (const auto& piece : frame->pieces.parts)
        buffers.push_back(net::buffer(piece.data(), piece.size()));
      frames.push_back(std::move(frame));
      if (!transport_->joins_frames()) break;
    }
    if (frames.empty() && ending_) {
      co_await transport_->finish(ec);
      co_return;
    }
    if (frames.empty()) {
      wake_.expires_at(Clock::time_point::max());
      co_await registry_.wait(wake_, ec);
      continue;
    }
    writing_ = Writing{.since = start, .bytes = net::buffer_size(buffers)};
    co_await transport_->write(buffers, ec);
    writing_.reset();
    if (ec) {
      registry_.executor().destroy_later(std::make_shared<std::vector<SharedFrame>>(std::move(frames)));
      close("client left");
      co_return;
    }
    const auto written = Clock::now();
    outbox_.written(written);
    for (const SharedFrame& frame : frames)
      registry_.metrics().wrote(frame->bytes(), posed && frame == frames.back());
    if (posed) registry_.metrics().took(Metrics::Stage::written, seconds(written - start));
    frames.clear();
    if (session_) session_->has_read();
  }
}

bool Connection::deliver(const PosedFrame& frame) {
  if (closed_ || ending_) return true;
  bool taken = true;
  told([&] {
    taken = outbox_.enqueue(frame.subscription, frame.level, frame.number, frame.keyframe, frame.bytes);
    wake_.cancel();
  });
  return taken;
}

std::uint32_t Connection::ask_level(std::uint32_t subscription, std::uint32_t finest, std::uint32_t coarsest,
                                    bool still) {
  return outbox_.ask_level(subscription, finest, coarsest, still, Clock::now());
}

void Connection::answer(std::uint64_t request_id, v1::Envelope envelope,
                        std::shared_ptr<const wire::Payload> payload) {
  if (closed_ || ending_) return;
  envelope.set_request_id(request_id);
  // What only this client reads is its frames' like: so long as it does not, it counts.
  const bool shared = payload.use_count() != 1;
  wire::EncodedFrame frame = wire::encode(envelope, std::move(payload));
  outbox_.answer(shared ? std::make_shared<const wire::EncodedFrame>(std::move(frame))
                        : registry_.memory().hold(std::move(frame)));
  wake_.cancel();
}

void Connection::answer_status(std::uint64_t request_id, const Status& status) {
  v1::Envelope envelope;
  wire::to_proto(status, *envelope.mutable_status());
  answer(request_id, std::move(envelope));
}

}  // namespace ecorche::server
