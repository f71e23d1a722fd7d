// SPDX-License-Identifier: Apache-2.0
// A small blocking client of the framed protocol (docs/reference/protocol.md).
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>

#include <ecorche/client/socket.hpp>
#include <ecorche/wire/framing.hpp>

namespace ecorche::client {

/// A status that is not OK, as the server sent it.
class ServerError : public Error {
 public:
  /// `where` names the request.
  ServerError(const std::string& where, const v1::Status& status);

  /// Never ok; `unknown` for a number that this version does not know.
  StatusCode code() const noexcept { return code_; }

 private:
  StatusCode code_;
};

/// How a server is entered.
struct Access {
  std::string authorities;   ///< PEM file whose certificates are trusted; empty: no TLS
  std::string token;         ///< of the right to connect
  std::string resume_token;  ///< ServerHello.resume_token of an earlier connection
  /// The session that will be opened, by which a balancer in front of several servers chooses one; for one of
  /// one's own something random, the same again for who comes back. Not needed without a balancer.
  std::string session = {};
};

/// One connection; for one thread. Frames are acknowledged and pings answered as they are read, so call
/// receive() often.
///
///   Client client(wire::parse_address("127.0.0.1:7070"), "my program");
///   v1::Envelope open;
///   open.mutable_open_model();
///   const wire::Frame opened = client.call(open);           // ModelOpened and its triangles
///   ...
///   client.send(pose);
///   while (auto message = client.receive(until)) { ... }    // PoseAck, MeshFrame, VolumeFrame
///
/// Errors: ServerError for what the server answers; temporary (nobody there, hung up, the server stops or has
/// no room), refused (PERMISSION_DENIED), usage (NOT_FOUND), protocol (anything else that it says or does).
class Client {
 public:
  /// How long the server may take for an answer.
  static constexpr std::chrono::seconds patience{30};

  /// Connects and exchanges the hellos; each takes 5 s at most.
  Client(const wire::Address& address, const std::string& name, const Access& access = {});

  /// What the server said of itself.
  const v1::ServerHello& server() const { return hello_; }

  /// HOST:PORT of another server, where this one sent its clients to when it said goodbye; else empty.
  const std::string& elsewhere() const { return elsewhere_; }

  /// Sends a request and waits for its answer; other messages meanwhile wait for receive(), but of each
  /// subscription's frames the newest only, and its keyframe. Throws when the answer is a Status that is not
  /// OK.
  wire::Frame call(v1::Envelope request, const std::shared_ptr<const wire::Payload>& payload = nullptr,
                   std::chrono::seconds within = patience);

  /// Sends what has no direct answer: poses.
  void send(const v1::Envelope& envelope, const std::shared_ptr<const wire::Payload>& payload = nullptr);

  /// The next message; nothing when none came whole until `until`. Throws when the server ends the
  /// connection.
  std::optional<wire::Frame> receive(Clock::time_point until);

  /// A message where it was read.
  struct Message {
    const v1::Envelope& envelope;
    const wire::Payload& payload;
  };
  /// As receive(), but it stays where it is, until the next call here: nothing is allocated once such
  /// messages have come.
  std::optional<Message> receive_in_place(Clock::time_point until);

  /// Says goodbye: the server keeps no place for who says so, and what it controlled is free at once. Waits
  /// until the server hangs up, no longer than `until`; nothing else may be called then. Throws nothing.
  void leave(Clock::time_point until) noexcept;

  /// An empty message to be filled and sent before any other call here, likewise.
  v1::Envelope& compose() { return outgoing_.make(); }

  /// A frame that was read to its end: its memory serves a later payload.
  void reuse(wire::Frame spent) { reader_.reuse(std::move(spent.payload)); }

  /// The system's handle of the socket: readable when receive() may have something.
  std::intptr_t handle() const { return socket_.handle(); }

  /// All read so far, framing included.
  std::uint64_t bytes_received() const { return bytes_received_; }

 private:
  bool read(Clock::time_point until, wire::MessageArena* arena);
  std::optional<wire::Frame> read_frame(Clock::time_point until);
  void attend(const v1::Envelope& envelope);
  void put_by(wire::Frame frame);

  Socket socket_;
  wire::FrameReader reader_;
  std::deque<wire::Frame> waiting_;
  wire::MessageArena incoming_, outgoing_;
  std::string head_;      ///< of what is sent
  wire::Frame in_place_;  ///< what receive_in_place() shows, but for an envelope in `incoming_`
  v1::ServerHello hello_;
  std::string elsewhere_;
  std::uint64_t last_request_ = 0;
  std::uint64_t bytes_received_ = 0;
};

}  // namespace ecorche::client
