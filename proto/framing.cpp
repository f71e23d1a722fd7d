// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/framing.hpp>

#include <algorithm>
#include <limits>
#include <utility>

namespace ecorche::wire {
namespace {

std::uint32_t load_u32(const std::byte* p) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | std::to_integer<std::uint32_t>(p[i]);
  return value;
}

void append_u32(std::string& out, std::size_t value) {
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<char>(value >> shift & 0xff));
}

}  // namespace

void encode_head(const v1::Envelope& envelope, std::size_t payload_bytes, std::string& head) {
  const std::size_t envelope_bytes = envelope.ByteSizeLong();
  // Protobuf itself ends at 2 GiB.
  if (envelope_bytes > std::numeric_limits<std::int32_t>::max() ||
      payload_bytes > std::numeric_limits<std::uint32_t>::max() || payload_bytes % alignment != 0) {
    throw Error(ErrorKind::internal, "frame",
                "an envelope of " + std::to_string(envelope_bytes) + " and a payload of " +
                    std::to_string(payload_bytes) + " bytes do not make a frame",
                "report this");
  }
  head.clear();
  head.reserve(aligned(header_bytes + envelope_bytes));
  append_u32(head, envelope_bytes);
  append_u32(head, payload_bytes);
  envelope.AppendToString(&head);
  head.resize(aligned(head.size()), '\0');
}

std::span<std::byte> FrameReader::prepare() {
  switch (part_) {
    case Part::header:
      return std::span(header_).subspan(filled_);
    case Part::envelope:
      return std::span(envelope_).subspan(filled_);
    case Part::payload:
      return std::span(frame_.payload).subspan(filled_);
    case Part::done:
      break;
  }
  return {};
}

Status FrameReader::commit(std::size_t n) {
  filled_ += n;
  if (part_ == Part::header && filled_ == header_bytes) return finish_header();
  if (part_ == Part::envelope && filled_ == envelope_.size()) return finish_envelope();
  if (part_ == Part::payload && filled_ == frame_.payload.size()) part_ = Part::done;
  return {};
}

Status FrameReader::finish_header() {
  envelope_bytes_ = load_u32(header_.data());
  payload_bytes_ = load_u32(header_.data() + 4);
  if (envelope_bytes_ == 0)
    return {StatusCode::invalid_argument, "frame: the envelope is empty (send one message a frame)"};
  if (envelope_bytes_ > limits_.envelope_bytes) {
    return {StatusCode::resource_exhausted, "frame: an envelope of " + std::to_string(envelope_bytes_) +
                                                " bytes (send at most " +
                                                std::to_string(limits_.envelope_bytes) + ")"};
  }
  if (payload_bytes_ > limits_.payload_bytes) {
    return {StatusCode::resource_exhausted, "frame: a payload of " + std::to_string(payload_bytes_) +
                                                " bytes (send at most " +
                                                std::to_string(limits_.payload_bytes) + ")"};
  }
  if (payload_bytes_ % alignment != 0) {
    return {StatusCode::invalid_argument,
            "frame: a payload of " + std::to_string(payload_bytes_) + " bytes (pad it to a multiple of 16)"};
  }
  envelope_.resize(aligned(header_bytes + envelope_bytes_) - header_bytes);
  filled_ = 0;
  part_ = Part::envelope;
  return {};
}

Status FrameReader::finish_envelope() {
  if (!std::all_of(envelope_.begin() + envelope_bytes_, envelope_.end(),
                   [](std::byte b) { return b == std::byte{0}; })) {
    return {StatusCode::invalid_argument, "frame: the padding is not zero (fill it with zeros)"};
  }
  made_ = arena_ ? &arena_->make() : nullptr;
  v1::Envelope& envelope = made_ ? *made_ : frame_.envelope;
  if (!envelope.ParseFromArray(envelope_.data(), static_cast<int>(envelope_bytes_))) {
    return {StatusCode::invalid_argument,
            "frame: the envelope is no ecorche.v1.Envelope (see proto/ecorche/v1)"};
  }
  filled_ = 0;
  if (payload_bytes_ > 0) frame_.payload = std::exchange(spent_, {});
  frame_.payload.resize(payload_bytes_);
  part_ = payload_bytes_ > 0 ? Part::payload : Part::done;
  return {};
}

Frame FrameReader::release() {
  if (made_) frame_.envelope = *std::exchange(made_, nullptr);
  part_ = Part::header;
  filled_ = 0;
  return std::exchange(frame_, {});
}

Payload FrameReader::release_payload() {
  part_ = Part::header;
  filled_ = 0;
  return std::exchange(frame_.payload, {});
}

std::size_t Pieces::bytes() const {
  std::size_t sum = 0;
  for (const std::span<const std::byte> part : parts) sum += part.size();
  return sum;
}

EncodedFrame encode(const v1::Envelope& envelope, std::shared_ptr<const Payload> payload) {
  std::string head;
  encode_head(envelope, payload ? payload->size() : 0, head);
  return {.head = std::move(head), .payload = std::move(payload)};
}

EncodedFrame encode(const v1::Envelope& envelope, Pieces pieces) {
  std::string head;
  encode_head(envelope, pieces.bytes(), head);
  return {.head = std::move(head), .payload = nullptr, .pieces = std::move(pieces)};
}

}  // namespace ecorche::wire
