// SPDX-License-Identifier: Apache-2.0
// A client of protocol 1 as it was when protocol 1 was new, byte for byte, and one that is newer than the
// server.
#include <array>
#include <cstring>

#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

std::string bytes_of(const std::string& hex) {
  std::string out;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    out += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return out;
}

// Golden: written once with protocol 1, never again. `pose` is meant for the rig of digest 1122334455667788.
const std::string kHello = bytes_of("13000000000000000801520f080110011a06676f6c64656e2a01010000000000");
const std::string kOpen = bytes_of("13000000000000000802620f0a03746f791206676f6c64656e18010000000000");
const std::string kSubscribe = bytes_of("100000000000000008036a0c0a0a0a04736b696e100120010000000000000000");
const std::string kPose = bytes_of(
    "7c000000000000007a7a08011188776655443322111a091900000000000014402260000000000000f03f00000000000000000000"
    "000000"
    "0000000000000000000000000000000000f03f000000000000000000000000000000000000000000000000000000000000f03f00"
    "000000"
    "00000000000000000000000000000000000000003002000000000000000000000000");
const std::string kAck = bytes_of("07000000000000008201040801100100");
const std::string kClaim = bytes_of("050000000000000008058a0100000000");
const std::string kIk = bytes_of(
    "28000000000000000806a201230a210802120919000000000000f03f1a0911000000000000004021000000000000f03f");
const std::string kPlay = bytes_of(
    "19000000000000000807ba01140a077475726e696e671100000000000000401801000000000000000000000000000000");
const std::string kMesh = bytes_of(
    "28000000100000008a04250801100218012199000000000000002801320a10011a060807100318013a060801100218030000803f"
    "00000040"
    "0000404000000000");

TEST(Versions, AClientOfTheFirstDayIsServed) {
  const TestServer server;
  RawClient client(server);
  client.send(kHello);
  const auto hello = client.receive();
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->envelope.request_id(), 1U);
  EXPECT_EQ(hello->envelope.server_hello().protocol(), 1U);
  client.send(kOpen);
  const auto opened = client.receive();
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->envelope.request_id(), 2U);
  EXPECT_EQ(opened->envelope.model_opened().session(), "golden");
  client.send(kSubscribe);
  EXPECT_EQ(client.receive()->envelope.subscribed().subscription(), 1U);
  const auto rest = client.receive();
  ASSERT_TRUE(rest);
  EXPECT_EQ(rest->envelope.mesh_frame().pose_sequence(), 0U);
  EXPECT_EQ(rest->envelope.mesh_frame().encoding(), v1::ENCODING_F32);
  client.send(kAck);

  std::string pose = kPose;
  const std::uint64_t digest = opened->envelope.model_opened().rig_digest();
  std::memcpy(pose.data() + pose.find(bytes_of("8877665544332211")), &digest, sizeof digest);
  client.send(pose);
  const auto ack = client.receive();
  ASSERT_TRUE(ack);
  EXPECT_EQ(ack->envelope.pose_ack().sequence(), 1U);
  EXPECT_EQ(ack->envelope.pose_ack().status().code(), 0U) << ack->envelope.pose_ack().status().message();
  const auto shown = client.receive();
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->envelope.mesh_frame().pose_sequence(), 1U);
  // All of it went up by 5 mm.
  const auto z = [](const wire::Frame& frame) {
    float value = 0;
    std::memcpy(&value, frame.payload.data() + 2 * sizeof(float), sizeof value);
    return value;
  };
  EXPECT_NEAR(z(*shown) - z(*rest), 5, 1e-3);
  for (const auto& [bytes, id] : {std::pair{kClaim, 5U}, {kIk, 6U}, {kPlay, 7U}}) {
    client.send(bytes);
    std::optional<wire::Frame> answer;
    while ((answer = client.receive()) && answer->envelope.request_id() != id) {
    }
    ASSERT_TRUE(answer) << id;
    EXPECT_EQ(answer->envelope.status().code(), 0U) << id;
  }
}

TEST(Versions, FramesOfTheFirstDayAreReadAndWritten) {
  wire::FrameReader reader({.envelope_bytes = 1024, .payload_bytes = 1024});
  std::size_t at = 0;
  while (!reader.complete()) {
    const auto into = reader.prepare();
    std::memcpy(into.data(), kMesh.data() + at, into.size());
    at += into.size();
    ASSERT_TRUE(reader.commit(into.size()).ok());
  }
  EXPECT_EQ(at, kMesh.size());
  const wire::Frame frame = reader.release();
  EXPECT_EQ(frame.envelope.mesh_frame().frame(), 2U);
  EXPECT_EQ(frame.envelope.mesh_frame().arrays(0).array().components(), 3U);
  std::array<float, 3> first{};
  std::memcpy(first.data(), frame.payload.data(), sizeof first);
  EXPECT_EQ(first, (std::array<float, 3>{1, 2, 3}));
  const wire::EncodedFrame again =
      wire::encode(frame.envelope, std::make_shared<const wire::Payload>(frame.payload));
  std::string bytes = again.head;
  bytes.append(reinterpret_cast<const char*>(again.payload->data()), again.payload->size());
  EXPECT_EQ(bytes, kMesh);
}

// What a newer version adds stands in numbers that this one does not know.
TEST(Versions, AClientThatIsNewerIsServedWithWhatBothKnow) {
  const TestServer server;
  RawClient client(server);
  v1::Envelope hello;
  hello.set_request_id(1);
  hello.mutable_client_hello()->set_protocol_min(1);
  hello.mutable_client_hello()->set_protocol_max(7);
  hello.mutable_client_hello()->add_features(static_cast<v1::Feature>(999));
  hello.mutable_client_hello()->add_encodings(v1::ENCODING_F32);
  hello.mutable_client_hello()->add_encodings(static_cast<v1::Encoding>(99));
  // Field 500 of ClientHello, of its own and of the envelope.
  std::string text = hello.SerializeAsString() + std::string("\xa2\x1f\x03new", 6);
  v1::Envelope extended;
  ASSERT_TRUE(extended.ParseFromString(text));
  client.send(extended);
  const auto answer = client.receive();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->envelope.server_hello().protocol(), 1U);
  v1::Envelope future;
  ASSERT_TRUE(future.ParseFromString(std::string("\xc2\x3e\x01\x00", 4)));  // member 1000
  future.set_request_id(2);
  client.send(future);
  EXPECT_EQ(client.receive()->envelope.status().code(),
            static_cast<std::uint32_t>(StatusCode::unimplemented));
  client.send(kOpen);
  EXPECT_TRUE(client.receive()->envelope.has_model_opened());
}

}  // namespace
}  // namespace ecorche::server
