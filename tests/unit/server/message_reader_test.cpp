// SPDX-License-Identifier: Apache-2.0
// Messages out of bytes that come in any pieces, without a socket.
#include "runtime/server/handlers/message_reader.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

namespace ecorche::server {
namespace {

constexpr wire::FrameLimits kLargeEnough{.envelope_bytes = 64 << 10, .payload_bytes = 1 << 20};

std::string ping_bytes(const std::string& data, std::size_t payload_bytes = 0) {
  v1::Envelope envelope;
  envelope.mutable_ping()->set_data(data);
  const auto payload = std::make_shared<const wire::Payload>(payload_bytes, std::byte{7});
  const wire::EncodedFrame frame = wire::encode(envelope, payload_bytes == 0 ? nullptr : payload);
  std::string bytes = frame.head;
  bytes.append(reinterpret_cast<const char*>(payload->data()), payload->size());
  return bytes;
}

// Reads as a transport would, so many bytes at a time; what the messages said, and the status that ended it.
struct Reading {
  std::vector<std::string> said;
  Status status;
};
Reading read_all(MessageReader& reader, const std::string& bytes, std::size_t at_a_time) {
  Reading reading;
  std::size_t done = 0;
  while (done < bytes.size() && reading.status.ok()) {
    const std::span<std::byte> into = reader.buffer();
    const std::size_t n = std::min({into.size(), at_a_time, bytes.size() - done});
    std::memcpy(into.data(), bytes.data() + done, n);
    done += n;
    reader.on_read(n, Clock::now(), std::nullopt);
    std::optional<wire::Frame> message;
    while ((reading.status = reader.next(message)).ok() && message)
      reading.said.push_back(message->envelope.ping().data() + "/" + std::to_string(message->payload.size()));
  }
  return reading;
}

TEST(MessageReaderTest, TakesMessagesInAnyPieces) {
  const std::string bytes =
      ping_bytes("a") + ping_bytes("b", 32) + ping_bytes("large", 32 << 10) + ping_bytes("z");
  const std::vector<std::string> expected{"a/0", "b/32", "large/32768", "z/0"};
  for (const std::size_t at_a_time : {1UL, 7UL, 64UL, 5000UL, 1UL << 20U}) {
    MessageReader reader(kLargeEnough);
    const Reading reading = read_all(reader, bytes, at_a_time);
    EXPECT_TRUE(reading.status.ok()) << reading.status.message;
    EXPECT_EQ(reading.said, expected) << at_a_time;
    EXPECT_TRUE(reader.between_frames());
    EXPECT_FALSE(reader.unfinished_since());
  }
}

TEST(MessageReaderTest, HandsOutWhatCameBeforeWhatIsRefused) {
  MessageReader reader({.envelope_bytes = 64, .payload_bytes = 0});
  Reading reading = read_all(reader, ping_bytes("a") + ping_bytes(std::string(100, 'x')), 4096);
  EXPECT_EQ(reading.said, std::vector<std::string>{"a/0"});
  EXPECT_EQ(reading.status.code, StatusCode::resource_exhausted);

  // As after a hello: what follows may be larger.
  MessageReader greeted({.envelope_bytes = 64, .payload_bytes = 0});
  EXPECT_TRUE(read_all(greeted, ping_bytes("a"), 4096).status.ok());
  greeted.set_limits(kLargeEnough);
  EXPECT_TRUE(read_all(greeted, ping_bytes(std::string(100, 'x')), 4096).status.ok());
}

TEST(MessageReaderTest, KnowsSinceWhenAMessageIsUnfinished) {
  MessageReader reader(kLargeEnough);
  const std::string bytes = ping_bytes("slow");
  const auto start = Clock::now();
  const auto feed = [&](std::size_t from, std::size_t count, Clock::time_point now) {
    std::memcpy(reader.buffer().data(), bytes.data() + from, count);
    reader.on_read(count, now, std::nullopt);
    std::optional<wire::Frame> message;
    EXPECT_TRUE(reader.next(message).ok());
    return message.has_value();
  };
  EXPECT_FALSE(reader.unfinished_since());
  EXPECT_FALSE(feed(0, 3, start));
  EXPECT_FALSE(feed(3, 9, start + std::chrono::seconds(1)));
  EXPECT_EQ(reader.unfinished_since(), start);
  EXPECT_TRUE(feed(12, bytes.size() - 12, start + std::chrono::seconds(2)));
  EXPECT_FALSE(reader.unfinished_since());
}

// A WebSocket's messages, which may come in pieces.
TEST(MessageReaderTest, AMessageOfTheCarrierIsOneFrame) {
  const auto feed = [](MessageReader& reader, const std::string& bytes, bool ended) {
    std::memcpy(reader.buffer().data(), bytes.data(), bytes.size());
    reader.on_read(bytes.size(), Clock::now(), ended);
    std::optional<wire::Frame> message;
    Status status = reader.next(message);
    EXPECT_EQ(message.has_value(), status.ok() && ended);
    return status;
  };
  const std::string frame = ping_bytes("a");
  MessageReader whole(kLargeEnough);
  EXPECT_TRUE(feed(whole, frame, true).ok());
  EXPECT_TRUE(feed(whole, frame.substr(0, 5), false).ok());
  EXPECT_TRUE(feed(whole, frame.substr(5), true).ok());
  for (const std::string& wrong : {frame + frame, frame + "x", frame.substr(0, 9), std::string()}) {
    MessageReader reader(kLargeEnough);
    const Status status = feed(reader, wrong, true);
    EXPECT_EQ(status.code, StatusCode::invalid_argument);
    EXPECT_EQ(status.message, "message: it holds more or less than one frame (send one frame a message)");
  }
}

}  // namespace
}  // namespace ecorche::server
