// SPDX-License-Identifier: Apache-2.0
#include <ecorche/client/client.hpp>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "core/values/utf8.hpp"

namespace ecorche::client {
namespace {

// What this client takes from a server. Protobuf and the framing end at 2 and 4 GiB; a body stays far below.
constexpr wire::FrameLimits kLimits{.envelope_bytes = 16U << 20, .payload_bytes = 2U << 30};

// Of a large payload, before it is read on: a tenth of a millisecond's copying.
constexpr std::size_t kEnough = 256U << 10;

constexpr std::uint32_t kProtocol = 1;

// For the connection, and then for the server's hello.
constexpr std::chrono::seconds kGreeting{5};

constexpr auto kHighestCode = static_cast<std::uint32_t>(StatusCode::unauthenticated);

ErrorKind kind_of(std::uint32_t code) {
  switch (static_cast<StatusCode>(code)) {
    case StatusCode::permission_denied:
    case StatusCode::unauthenticated:
      return ErrorKind::refused;
    case StatusCode::resource_exhausted:
    case StatusCode::unavailable:
    case StatusCode::deadline_exceeded:
      return ErrorKind::temporary;
    case StatusCode::not_found:
      return ErrorKind::usage;
    default:
      return ErrorKind::protocol;
  }
}

// 64 bytes of it at most, in whole characters: a message with half a one is none.
std::string short_text(std::string_view name) {
  std::string line = text::one_line(name);
  std::size_t end = std::min<std::size_t>(line.size(), 64);
  while (end < line.size() && (static_cast<unsigned char>(line[end]) & 0xC0U) == 0x80U) --end;
  line.resize(end);
  return line;
}

// What a frame shows, of which subscription.
struct Shown {
  bool mesh, key;  // key: others may be against it
  std::uint32_t subscription, level;
};

std::optional<Shown> shown_by(const v1::Envelope& envelope) {
  if (envelope.has_mesh_frame()) {
    const v1::MeshFrame& mesh = envelope.mesh_frame();
    return Shown{true, mesh.keyframe() == mesh.frame(), mesh.subscription(), mesh.level()};
  }
  if (!envelope.has_volume_frame()) return std::nullopt;
  const v1::VolumeFrame& volume = envelope.volume_frame();
  return Shown{false, volume.keyframe() == volume.frame(), volume.subscription(), 0};
}

// Whether nobody needs `older` once `newer` is there.
bool replaces(const Shown& newer, const Shown& older) {
  if (newer.mesh != older.mesh || newer.subscription != older.subscription) return false;
  return !older.key || (newer.key && newer.level == older.level);
}

}  // namespace

ServerError::ServerError(const std::string& where, const v1::Status& status)
    : Error(kind_of(status.code()), where,
            "status " + std::to_string(status.code()) + ": " + status.message(),
            "this is the server's answer"),
      code_(status.code() <= kHighestCode ? static_cast<StatusCode>(status.code()) : StatusCode::unknown) {}

Client::Client(const wire::Address& address, const std::string& name, const Access& access)
    : socket_(address, Clock::now() + kGreeting, access.authorities), reader_(kLimits) {
  v1::Envelope envelope;
  v1::ClientHello& hello = *envelope.mutable_client_hello();
  hello.set_protocol_min(kProtocol);
  hello.set_protocol_max(kProtocol);
  hello.set_client(short_text(name));
  // MeshDecoder reads them all.
  for (const v1::Encoding encoding : {v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA})
    hello.add_encodings(encoding);
  hello.set_token(access.token);
  hello.set_resume_token(access.resume_token);
  hello.set_session(access.session);
  wire::Frame answer = call(std::move(envelope), nullptr, kGreeting);
  if (!answer.envelope.has_server_hello()) {
    throw Error(ErrorKind::protocol, "hello", "the server answered with something else",
                "check that it is ecorche serve");
  }
  hello_ = std::move(*answer.envelope.mutable_server_hello());
  if (hello_.protocol() != kProtocol) {
    throw Error(ErrorKind::protocol, "hello",
                "the server speaks protocol " + std::to_string(hello_.protocol()) + ", this client " +
                    std::to_string(kProtocol),
                "use a client of the server's version");
  }
}

wire::Frame Client::call(v1::Envelope request, const std::shared_ptr<const wire::Payload>& payload,
                         std::chrono::seconds within) {
  const std::uint64_t id = ++last_request_;
  request.set_request_id(id);
  send(request, payload);
  const auto until = Clock::now() + within;
  while (auto frame = read_frame(until)) {
    if (frame->envelope.request_id() != id) {
      put_by(std::move(*frame));
      continue;
    }
    if (frame->envelope.has_status() && frame->envelope.status().code() != 0)
      throw ServerError("server", frame->envelope.status());
    return std::move(*frame);
  }
  throw Error(ErrorKind::temporary, "server", "no answer within " + std::to_string(within.count()) + " s",
              "try again");
}

// They are acknowledged already, so more come: for who asks more often than it receives they would pile up.
void Client::put_by(wire::Frame frame) {
  if (const auto newer = shown_by(frame.envelope)) {
    std::erase_if(waiting_, [&](const wire::Frame& waits) {
      const auto older = shown_by(waits.envelope);
      return older && replaces(*newer, *older);
    });
  }
  waiting_.push_back(std::move(frame));
}

void Client::send(const v1::Envelope& envelope, const std::shared_ptr<const wire::Payload>& payload) {
  wire::encode_head(envelope, payload ? payload->size() : 0, head_);
  socket_.write(std::as_bytes(std::span(head_)), Clock::now() + patience);
  if (payload) socket_.write(*payload, Clock::now() + patience);
}

void Client::leave(Clock::time_point until) noexcept {
  try {
    v1::Envelope& last = compose();
    last.mutable_goodbye();
    wire::encode_head(last, 0, head_);
    socket_.write(std::as_bytes(std::span(head_)), until);
    // What is still on its way is read: to close over unread bytes resets the connection, and the goodbye may
    // be lost with it.
    std::array<std::byte, 16384> rest{};
    while (Clock::now() < until && socket_.read(rest, until) > 0) {
    }
  } catch (const std::exception&) {  // it hung up
  }
}

std::optional<wire::Frame> Client::receive(Clock::time_point until) {
  if (waiting_.empty()) return read_frame(until);
  wire::Frame frame = std::move(waiting_.front());
  waiting_.pop_front();
  return frame;
}

std::optional<Client::Message> Client::receive_in_place(Clock::time_point until) {
  if (!in_place_.payload.empty()) reuse(std::exchange(in_place_, {}));
  if (!waiting_.empty()) {
    in_place_ = std::move(waiting_.front());
    waiting_.pop_front();
    return Message{in_place_.envelope, in_place_.payload};
  }
  if (!read(until, &incoming_)) return std::nullopt;
  in_place_.payload = reader_.release_payload();
  attend(reader_.envelope());
  return Message{reader_.envelope(), in_place_.payload};
}

std::optional<wire::Frame> Client::read_frame(Clock::time_point until) {
  if (!read(until, nullptr)) return std::nullopt;
  wire::Frame frame = reader_.release();
  attend(frame.envelope);
  return frame;
}

// Until a frame is whole; false where none was in time. `arena`: where its envelope is made.
bool Client::read(Clock::time_point until, wire::MessageArena* arena) {
  reader_.make_envelopes_in(arena);
  while (!reader_.complete()) {
    const std::span<std::byte> want = reader_.prepare();
    const std::size_t n = socket_.read(want, until, std::min(want.size(), kEnough));
    if (n == 0) return false;
    bytes_received_ += n;
    if (const Status status = reader_.commit(n); !status.ok()) {
      throw Error(ErrorKind::protocol, "server", status.message, "check that it is ecorche serve");
    }
  }
  return true;
}

// What the protocol asks of every client at once.
void Client::attend(const v1::Envelope& envelope) {
  if (envelope.has_mesh_frame() || envelope.has_volume_frame()) {
    v1::Envelope& answer = compose();
    const bool mesh = envelope.has_mesh_frame();
    v1::FrameAck& ack = *answer.mutable_frame_ack();
    ack.set_subscription(mesh ? envelope.mesh_frame().subscription()
                              : envelope.volume_frame().subscription());
    ack.set_frame(mesh ? envelope.mesh_frame().frame() : envelope.volume_frame().frame());
    send(answer);
  } else if (envelope.has_ping()) {
    v1::Envelope& answer = compose();
    answer.set_request_id(envelope.request_id());
    answer.mutable_pong()->set_data(envelope.ping().data());
    send(answer);
  } else if (envelope.has_goodbye()) {
    elsewhere_ = envelope.goodbye().elsewhere();
    throw ServerError("server", envelope.goodbye().status());
  } else if (envelope.has_status() && envelope.request_id() == 0) {
    throw ServerError("server", envelope.status());
  }
}

}  // namespace ecorche::client
