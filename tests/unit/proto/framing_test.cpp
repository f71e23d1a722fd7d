// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/framing.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

namespace ecorche::wire {
namespace {

constexpr FrameLimits kLimits{.envelope_bytes = 1024, .payload_bytes = 1024};

std::string bytes_of(const EncodedFrame& frame) {
  std::string bytes = frame.head;
  if (frame.payload)
    bytes.append(reinterpret_cast<const char*>(frame.payload->data()), frame.payload->size());
  for (const auto& part : frame.pieces.parts)
    bytes.append(reinterpret_cast<const char*>(part.data()), part.size());
  EXPECT_EQ(frame.bytes(), bytes.size());
  return bytes;
}

// Gives `bytes` to a reader in pieces of at most `piece`; stops at a frame, at an error, or when they are
// used up.
Status feed(FrameReader& reader, std::string_view bytes, std::size_t piece = 1 << 20) {
  while (!bytes.empty() && !reader.complete()) {
    const std::span<std::byte> want = reader.prepare();
    const std::size_t n = std::min({want.size(), bytes.size(), piece});
    std::memcpy(want.data(), bytes.data(), n);
    if (Status status = reader.commit(n); !status.ok()) return status;
    bytes.remove_prefix(n);
  }
  return {};
}

v1::Envelope a_ping() {
  v1::Envelope envelope;
  envelope.set_request_id(5);
  envelope.mutable_ping()->set_data("hi");
  return envelope;
}

std::shared_ptr<const Payload> sixteen_bytes() {
  Payload payload(16);
  for (int i = 0; i < 16; ++i) payload[static_cast<std::size_t>(i)] = static_cast<std::byte>(0xa0 + i);
  return std::make_shared<const Payload>(std::move(payload));
}

// In an arena, in the frame, and from one to the other in the middle of a frame.
TEST(Framing, EnvelopesAreTheSameWhereverTheyAreMade) {
  const std::string ping = bytes_of(encode(a_ping(), sixteen_bytes()));
  const std::string told = a_ping().SerializeAsString();
  MessageArena arena;
  FrameReader reader(kLimits);
  const auto expect_payload = [](const Payload& payload) { EXPECT_EQ(payload, *sixteen_bytes()); };
  for (int round = 0; round < 3; ++round) {
    reader.make_envelopes_in(&arena);
    ASSERT_TRUE(feed(reader, ping).ok());
    expect_payload(reader.release_payload());
    EXPECT_EQ(reader.envelope().SerializeAsString(), told);
    EXPECT_FALSE(reader.complete());
    reader.make_envelopes_in(round == 0 ? nullptr : &arena);
    const std::size_t most = ping.size() - 5;
    ASSERT_TRUE(feed(reader, std::string_view(ping).substr(0, most)).ok());
    reader.make_envelopes_in(round == 0 ? &arena : nullptr);
    ASSERT_TRUE(feed(reader, std::string_view(ping).substr(most)).ok());
    EXPECT_EQ(reader.envelope().SerializeAsString(), told);
    if (round == 1) {
      const Frame frame = reader.release();
      EXPECT_EQ(frame.envelope.SerializeAsString(), told);
      expect_payload(frame.payload);
    } else {
      expect_payload(reader.release_payload());
      EXPECT_EQ(reader.envelope().SerializeAsString(), told);
    }
  }
}

// What is large once makes room, and leaves nothing of itself.
TEST(MessageArena, AnEnvelopeIsEmptyWhateverCameBefore) {
  MessageArena arena;
  for (const int angles : {3, 100'000, 10}) {
    v1::Envelope& envelope = arena.make();
    EXPECT_EQ(envelope.ByteSizeLong(), 0U);
    for (int i = 0; i < angles; ++i) envelope.mutable_pose_update()->add_rotation(i);
    EXPECT_EQ(envelope.pose_update().rotation_size(), angles);
    EXPECT_EQ(envelope.pose_update().rotation(angles - 1), angles - 1);
  }
}

// The wire's first release, byte by byte: these never change while the protocol is 1.
TEST(Framing, GoldenBytes) {
  const std::string golden(
      "\x09\x00\x00\x00"                                              // envelope_bytes
      "\x10\x00\x00\x00"                                              // payload_bytes
      "\x08\x05"                                                      // request_id = 5
      "\xc2\x02\x04"                                                  // ping (member 40), 4 bytes
      "\x0a\x02hi"                                                    // data = "hi"
      "\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00"  // zeros: 17 bytes so far, 32 the next
                                                                      // multiple of 16
      "\xa0\xa1\xa2\xa3\xa4\xa5\xa6\xa7\xa8\xa9\xaa\xab\xac\xad\xae\xaf",
      48);
  EXPECT_EQ(bytes_of(encode(a_ping(), sixteen_bytes())), golden);
  const auto payload = sixteen_bytes();
  const std::span<const std::byte> whole(*payload);
  EXPECT_EQ(bytes_of(encode(a_ping(), Pieces{{whole.first(5), whole.subspan(5)}, payload})), golden);
  FrameReader reader(kLimits);
  ASSERT_TRUE(feed(reader, golden).ok());
  ASSERT_TRUE(reader.complete());
  const Frame frame = reader.release();
  EXPECT_EQ(frame.envelope.request_id(), 5U);
  EXPECT_EQ(frame.envelope.ping().data(), "hi");
  EXPECT_EQ(frame.payload, *sixteen_bytes());
}

TEST(Framing, WithoutPayloadTheFrameStillEndsOnSixteen) {
  for (const std::size_t length : {0U, 1U, 2U, 3U, 4U, 5U, 12U, 40U}) {
    v1::Envelope envelope;
    envelope.mutable_ping()->set_data(std::string(length, 'x'));
    EXPECT_EQ(bytes_of(encode(envelope)).size() % 16, 0U) << length;
  }
}

TEST(Framing, FramesFollowEachOtherInAnyPieces) {
  const std::string one = bytes_of(encode(a_ping(), sixteen_bytes()));
  for (std::size_t piece = 1; piece <= one.size(); ++piece) {
    FrameReader reader(kLimits);
    for (int i = 0; i < 3; ++i) {
      EXPECT_TRUE(reader.between_frames());
      ASSERT_TRUE(feed(reader, one, piece).ok());
      ASSERT_TRUE(reader.complete());
      EXPECT_EQ(reader.release().envelope.request_id(), 5U);
    }
  }
}

TEST(Framing, MemoryThatIsGivenBackServesTheNextPayloadWhateverItsSize) {
  const std::string ping = bytes_of(encode(a_ping(), sixteen_bytes()));
  for (const std::size_t size : {std::size_t{0}, std::size_t{16}, std::size_t{4096}}) {
    FrameReader reader(kLimits);
    Payload spent(size, std::byte{0xff});
    const std::byte* const memory = spent.data();
    reader.reuse(std::move(spent));
    ASSERT_TRUE(feed(reader, bytes_of(encode(a_ping()))).ok());
    EXPECT_TRUE(reader.release().payload.empty()) << "memory for none";
    ASSERT_TRUE(feed(reader, ping, 5).ok());
    const Frame frame = reader.release();
    EXPECT_EQ(frame.payload, *sixteen_bytes());
    if (size > 0) {
      EXPECT_EQ(frame.payload.data(), memory);
    }
  }
}

TEST(Framing, EveryPrefixWaits) {
  const std::string bytes = bytes_of(encode(a_ping(), sixteen_bytes()));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    FrameReader reader(kLimits);
    EXPECT_TRUE(feed(reader, std::string_view(bytes).substr(0, length)).ok());
    EXPECT_FALSE(reader.complete()) << length;
    EXPECT_FALSE(reader.prepare().empty()) << length;
  }
}

Status header_status(std::uint32_t envelope_bytes, std::uint32_t payload_bytes, FrameReader& reader) {
  std::string header;
  for (const std::uint32_t value : {envelope_bytes, payload_bytes}) {
    for (int shift = 0; shift < 32; shift += 8) header.push_back(static_cast<char>(value >> shift & 0xff));
  }
  return feed(reader, header);
}

TEST(Framing, SizesAreRefusedBeforeAnythingIsAllocated) {
  struct Bad {
    std::uint32_t envelope_bytes, payload_bytes;
    StatusCode code;
  };
  for (const Bad& bad :
       {Bad{0, 0, StatusCode::invalid_argument}, Bad{1025, 0, StatusCode::resource_exhausted},
        Bad{0xffffffff, 0, StatusCode::resource_exhausted}, Bad{8, 1040, StatusCode::resource_exhausted},
        Bad{8, 0xfffffff0, StatusCode::resource_exhausted}, Bad{8, 8, StatusCode::invalid_argument}}) {
    FrameReader reader(kLimits);
    EXPECT_EQ(header_status(bad.envelope_bytes, bad.payload_bytes, reader).code, bad.code)
        << bad.envelope_bytes << " " << bad.payload_bytes;
    // Still the header's own eight bytes: nothing was made room for.
    EXPECT_LE(reader.prepare().size(), header_bytes);
  }
  FrameReader reader(kLimits);
  EXPECT_TRUE(header_status(1024, 1024, reader).ok());
}

TEST(Framing, PaddingMustBeZeroAndTheEnvelopeProtobuf) {
  std::string bytes = bytes_of(encode(a_ping()));
  bytes.back() = 1;
  FrameReader reader(kLimits);
  EXPECT_EQ(feed(reader, bytes).code, StatusCode::invalid_argument);

  bytes = bytes_of(encode(a_ping()));
  bytes[8] = '\x07';  // a wire type that does not exist
  FrameReader second(kLimits);
  EXPECT_EQ(feed(second, bytes).code, StatusCode::invalid_argument);
}

TEST(Framing, UnknownMessagesArriveAsNothing) {
  // Member 1000 of a newer protocol.
  std::string bytes("\x04\x00\x00\x00\x00\x00\x00\x00\xc2\x3e\x01\x00\x00\x00\x00\x00", 16);
  FrameReader reader(kLimits);
  ASSERT_TRUE(feed(reader, bytes).ok());
  ASSERT_TRUE(reader.complete());
  EXPECT_EQ(reader.release().envelope.message_case(), v1::Envelope::MESSAGE_NOT_SET);
}

TEST(Framing, RandomBytesNeverHarm) {
  std::mt19937 random(1);
  for (int run = 0; run < 2000; ++run) {
    std::string bytes(16 + random() % 256, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    // Half of them with a plausible header, so that the envelope is reached.
    if (run % 2 == 0) bytes.replace(0, 8, std::string("\x18\0\0\0\x10\0\0\0", 8));
    FrameReader reader(kLimits);
    const Status status = feed(reader, bytes);
    if (status.ok() && reader.complete()) reader.release();
  }
}

TEST(Framing, FlippedBitsGiveAFrameOrAStatus) {
  const std::string good = bytes_of(encode(a_ping(), sixteen_bytes()));
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    std::string bytes = good;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << bit % 8));
    FrameReader reader(kLimits);
    const Status status = feed(reader, bytes);
    EXPECT_TRUE(status.ok() || !status.message.empty());
  }
}

TEST(Framing, APayloadThatIsNoMultipleOfSixteenIsOurBug) {
  EXPECT_THROW(encode(a_ping(), std::make_shared<const Payload>(8)), Error);
}

}  // namespace
}  // namespace ecorche::wire
