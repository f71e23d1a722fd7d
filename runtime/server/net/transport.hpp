// SPDX-License-Identifier: Apache-2.0
// What carries frames to and from one client: TCP, TLS over it, WebSocket messages over either.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/net/close_reason.hpp"

namespace ecorche::server {

/// One reading and one writing coroutine at a time, both on the I/O thread. Nothing here has a deadline of
/// its own: whoever owns it calls close(), and what is under way ends with an error.
class Transport {
 public:
  virtual ~Transport() = default;

  virtual net::any_io_executor executor() = 0;
  /// What must pass before the first byte (TLS' handshake).
  virtual net::awaitable<void> open(boost::system::error_code& ec) = 0;
  /// At least a byte, unless a message of the carrier was empty.
  virtual net::awaitable<std::size_t> read_some(std::span<std::byte> out, boost::system::error_code& ec) = 0;
  /// All of one frame, or, where joins_frames(), of several.
  virtual net::awaitable<void> write(std::span<const net::const_buffer> frame,
                                     boost::system::error_code& ec) = 0;
  /// Nothing more is written; the client may read to the end.
  virtual net::awaitable<void> finish(boost::system::error_code& ec) = 0;
  virtual void close() = 0;

  /// When bytes of a write last went on their way, parts of the one under way included: TCP and TLS tell it
  /// of parts of 512 KiB at most. Nothing before the first, or where the carrier cannot tell.
  virtual std::optional<Clock::time_point> moved() const { return std::nullopt; }

  /// The client has gone, or closed its side, though what it sent before may not be read yet. False where the
  /// system does not tell.
  virtual bool hung_up() { return false; }

  /// Where the carrier has messages, and one must be one frame: whether the last byte read ended one.
  virtual std::optional<bool> message_ended() const { return std::nullopt; }
  /// What was read last is of a kind that holds no frames, such as a WebSocket's text.
  virtual bool wrong_kind() const { return false; }
  /// What finish() is to say, where the carrier has words for it.
  virtual void ends_by(CloseReason) {}
  /// Without messages, frames may leave in one write.
  bool joins_frames() const { return !message_ended().has_value(); }
};

std::unique_ptr<Transport> tcp_transport(tcp::socket socket);

/// As every client's socket is: nothing waits to be joined with what comes later, and the kernel keeps a MiB
/// for who does not read.
void prepare(tcp::socket& socket);

/// `127.0.0.1:4711`, or `?` once it has gone.
std::string peer_of(const tcp::socket& socket);

/// As Transport::hung_up().
bool hung_up(tcp::socket& socket);

/// How long an accepted socket stood in the kernel, to a few milliseconds, from its client's last word where
/// that has sent some; 0 where the system does not tell.
Clock::duration waited(tcp::socket& socket);

}  // namespace ecorche::server
