// SPDX-License-Identifier: Apache-2.0
// Frames on the wire (docs/reference/protocol.md): u32 envelope_bytes, u32 payload_bytes, little-endian; the
// envelope; zeros up to a multiple of 16 counted from the frame's start; the payload, itself a multiple of 16
// long.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/v1/envelope.pb.h>
#include <ecorche/values/error.hpp>
#include <ecorche/wire/message_arena.hpp>

namespace ecorche::wire {

inline constexpr std::size_t header_bytes = 8;
inline constexpr std::size_t alignment = 16;

/// The next multiple of 16.
constexpr std::size_t aligned(std::size_t bytes) {
  return (bytes + alignment - 1) / alignment * alignment;
}

/// Raw arrays (arrays.hpp).
using Payload = std::vector<std::byte>;

/// An envelope, and the arrays that it describes.
struct Frame {
  v1::Envelope envelope;
  Payload payload;
};

/// What a receiver takes; looked at before anything is allocated.
struct FrameLimits {
  std::uint32_t envelope_bytes = 0;
  std::uint32_t payload_bytes = 0;
};

/// Takes a stream of bytes apart. It asks for bytes instead of being fed, so that a payload is read from the
/// socket to where it stays:
///
///   while (!reader.complete()) { n = read(socket, reader.prepare()); status = reader.commit(n); if
///   (!status.ok()) ... }
///
/// After a status that is not ok the stream is lost: a frame's end cannot be found any more.
class FrameReader {
 public:
  /// Refuses what is larger than `limits`.
  explicit FrameReader(FrameLimits limits) : limits_(limits) {}

  /// For the frames after the present one.
  void set_limits(FrameLimits limits) { limits_ = limits; }

  /// Where the next bytes go; never empty unless a frame is complete.
  std::span<std::byte> prepare();

  /// The first `n` bytes of prepare() were filled. resource_exhausted for a frame beyond the limits,
  /// invalid_argument for one that is not a frame: an empty envelope, a payload that is no multiple of 16,
  /// padding that is not zero, no Protobuf.
  Status commit(std::size_t n);

  /// Whether a frame is there to take.
  bool complete() const { return part_ == Part::done; }
  /// No byte of a frame has come yet.
  bool between_frames() const { return part_ == Part::header && filled_ == 0; }
  /// The complete frame; the reader then waits for the next.
  Frame release();
  /// As release(), for who is content with envelope(), which is not copied then.
  Payload release_payload();
  /// Of the frame that is, or was, complete; until the next one's has come.
  const v1::Envelope& envelope() const { return made_ ? *made_ : frame_.envelope; }
  /// Envelopes are made there from now on; null: as a part of each frame. It must outlive the reader.
  void make_envelopes_in(MessageArena* arena) { arena_ = arena; }
  /// Memory for the next payload, which need not be cleared then: at 16 MB that takes as long as reading it.
  void reuse(Payload spent) { spent_ = std::move(spent); }

 private:
  enum class Part : std::uint8_t { header, envelope, payload, done };

  Status finish_header();
  Status finish_envelope();

  FrameLimits limits_;
  Part part_ = Part::header;
  std::size_t filled_ = 0;  ///< of the present part
  std::array<std::byte, header_bytes> header_{};
  std::uint32_t envelope_bytes_ = 0, payload_bytes_ = 0;
  std::vector<std::byte> envelope_;  ///< and its padding
  Frame frame_;
  Payload spent_;
  MessageArena* arena_ = nullptr;
  v1::Envelope* made_ = nullptr;  ///< in an arena; else the envelope is that of `frame_`
};

/// A payload whose bytes lie in several places, in their order.
struct Pieces {
  std::vector<std::span<const std::byte>> parts;
  std::shared_ptr<const void> owner;  ///< keeps what they show

  /// Of all parts.
  std::size_t bytes() const;
};

/// A frame ready for any number of sockets: header, envelope and padding in one piece, the payload shared.
struct EncodedFrame {
  std::string head;
  std::shared_ptr<const Payload> payload;  ///< may be null
  Pieces pieces = {};                      ///< or the payload is these

  /// Bytes behind the head.
  std::size_t payload_bytes() const { return payload ? payload->size() : pieces.bytes(); }
  /// Bytes of the whole frame.
  std::size_t bytes() const { return head.size() + payload_bytes(); }
};

/// Throws Error{internal} when the payload is no multiple of 16 or either part does not fit 32 bits.
EncodedFrame encode(const v1::Envelope& envelope, std::shared_ptr<const Payload> payload = nullptr);
EncodedFrame encode(const v1::Envelope& envelope, Pieces pieces);
/// EncodedFrame::head into `head`, whose memory is used again. Throws as encode().
void encode_head(const v1::Envelope& envelope, std::size_t payload_bytes, std::string& head);

}  // namespace ecorche::wire
