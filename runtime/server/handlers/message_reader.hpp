// SPDX-License-Identifier: Apache-2.0
// Messages out of the bytes that a transport brings.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include <ecorche/wire/framing.hpp>
#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

/// Knows no socket:
///
///   n = read(socket, reader.buffer()); reader.on_read(n, ...);
///   while (reader.next(frame).ok() && frame) ...
///
/// After a status that is not ok the stream is lost.
class MessageReader {
 public:
  explicit MessageReader(wire::FrameLimits limits) : frames_(limits) {}
  /// For the messages after the present one.
  void set_limits(wire::FrameLimits limits) { frames_.set_limits(limits); }

  /// Where the next read goes. Several small messages come in one read; what is long goes where it stays.
  std::span<std::byte> buffer();
  /// The first `n` bytes of buffer() were filled, at `now`. `message_ended`: as Transport::message_ended().
  void on_read(std::size_t n, Clock::time_point now, std::optional<bool> message_ended);
  /// The next whole message of what was read; nothing where that ends before one does. resource_exhausted and
  /// invalid_argument as wire::FrameReader; invalid_argument, too, where a message of the carrier holds more
  /// or less than one frame.
  Status next(std::optional<wire::Frame>& out);

  bool between_frames() const { return frames_.between_frames(); }
  /// When the first byte came of a message that is not whole yet.
  std::optional<Clock::time_point> unfinished_since() const { return unfinished_since_; }

 private:
  Status advance();

  wire::FrameReader frames_;
  std::array<std::byte, 4096> inbox_;
  bool direct_ = false;                  ///< buffer() was the frame's own memory
  bool pending_ = false;                 ///< something was read that next() has not looked at
  std::size_t filled_ = 0;               ///< of the frame's own memory
  std::span<const std::byte> unparsed_;  ///< of the inbox
  std::optional<bool> message_ended_;
  Clock::time_point read_at_{};
  std::optional<Clock::time_point> unfinished_since_;
};

}  // namespace ecorche::server
