// SPDX-License-Identifier: Apache-2.0
// Clients that break the protocol end themselves and nobody else.
#include <random>

#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

// The server still poses for a good client.
void expect_alive(const TestServer& server) {
  TestClient client(server);
  client.subscribe_mesh();
  client.send(1, client.bent(0.3));
  client.next_mesh(1);
}

v1::Envelope hello(std::uint32_t lowest, std::uint32_t highest) {
  v1::Envelope envelope;
  envelope.mutable_client_hello()->set_protocol_min(lowest);
  envelope.mutable_client_hello()->set_protocol_max(highest);
  return envelope;
}

TEST(Hostile, OtherVersionsAreToldTheRange) {
  const TestServer server;
  for (const auto& [lowest, highest] : {std::pair{0U, 0U}, {2U, 9U}, {5U, 1U}}) {
    RawClient client(server);
    client.send(hello(lowest, highest));
    const auto answer = client.receive();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::failed_precondition));
    EXPECT_NE(answer->envelope.status().message().find("1 to 1"), std::string::npos);
    EXPECT_TRUE(client.hung_up());
  }
  RawClient newer(server);
  newer.send(hello(1, 9));
  const auto answer = newer.receive();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->envelope.server_hello().protocol(), 1U);
}

TEST(Hostile, AnythingBeforeTheHelloEndsTheConnection) {
  const TestServer server;
  RawClient client(server);
  v1::Envelope list;
  list.mutable_list_models();
  client.send(list);
  EXPECT_EQ(client.last_words(), StatusCode::failed_precondition);

  RawClient twice(server);
  twice.send_hello();
  twice.send_hello();
  EXPECT_EQ(twice.last_words(), StatusCode::failed_precondition);
}

TEST(Hostile, ForeignEncodingsAreRefused) {
  const TestServer server;
  v1::Envelope delta_only = hello(1, 1);
  delta_only.mutable_client_hello()->add_encodings(v1::ENCODING_U16_DELTA);
  RawClient b(server);
  b.send(delta_only);
  EXPECT_EQ(b.last_words(), StatusCode::failed_precondition);
}

TEST(Hostile, WhatIsNotKnownAnswersUnimplementedAndGoesOn) {
  const TestServer server;
  RawClient client(server);
  client.send_hello();
  ASSERT_TRUE(client.receive());
  std::vector<v1::Envelope> requests(3);
  requests[0].mutable_mesh_frame();  // a server's message
  ASSERT_TRUE(
      requests[1].ParseFromString(std::string("\xc2\x3e\x01\x00", 4)));  // member 1000 of a newer protocol
  requests[2].mutable_control_changed();
  for (std::size_t i = 0; i < requests.size(); ++i) {
    requests[i].set_request_id(100 + i);
    client.send(requests[i]);
    const auto answer = client.receive();
    ASSERT_TRUE(answer) << i;
    EXPECT_EQ(answer->envelope.request_id(), 100 + i);
    EXPECT_EQ(answer->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::unimplemented)) << i;
  }
}

TEST(Hostile, EveryCommandBeforeAModelIsOpenIsRefused) {
  const TestServer server;
  RawClient client(server);
  client.send_hello();
  ASSERT_TRUE(client.receive());
  std::vector<v1::Envelope> requests(7);
  requests[0].mutable_claim_control();
  requests[1].mutable_release_control();
  requests[2].mutable_solve_ik();
  requests[3].mutable_record();
  requests[4].mutable_list_clips();
  requests[5].mutable_play_clip();
  requests[6].mutable_set_thresholds();
  for (v1::Envelope& request : requests) {
    request.set_request_id(9);
    client.send(request);
    const auto answer = client.receive();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::failed_precondition))
        << request.message_case();
  }
}

TEST(Hostile, StreamingBeforeOpeningIsAnswered) {
  const TestServer server;
  RawClient client(server);
  client.send_hello();
  ASSERT_TRUE(client.receive());
  v1::Envelope subscribe;
  subscribe.mutable_subscribe()->mutable_mesh();
  client.send(subscribe);
  EXPECT_EQ(client.receive()->envelope.status().code(),
            static_cast<std::uint32_t>(StatusCode::failed_precondition));
  v1::Envelope pose;
  pose.mutable_pose_update()->set_sequence(1);
  client.send(pose);
  EXPECT_EQ(client.receive()->envelope.pose_ack().status().code(),
            static_cast<std::uint32_t>(StatusCode::failed_precondition));
  v1::Envelope ack;
  ack.mutable_frame_ack()->set_subscription(77);
  client.send(ack);
  v1::Envelope ping;
  ping.mutable_ping();
  client.send(ping);
  EXPECT_TRUE(client.receive()->envelope.has_pong());
}

TEST(Hostile, RandomBytesEndOneConnection) {
  const TestServer server;
  std::mt19937 random(3);
  for (int run = 0; run < 30; ++run) {
    RawClient client(server);
    if (run % 2 == 0) {
      client.send_hello();
      ASSERT_TRUE(client.receive());
    }
    std::string bytes(200, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    if (run % 3 == 0) bytes.replace(0, 8, std::string("\x40\0\0\0\0\0\0\0", 8));
    try {
      client.send(bytes);
    } catch (const Error&) {  // hung up already
    }
  }
  expect_alive(server);
}

TEST(Hostile, EveryPrefixOfAConversationMayBeTheLast) {
  const TestServer server;
  std::string conversation = wire::encode(hello(1, 1)).head;
  v1::Envelope open;
  open.mutable_open_model()->set_session("prefix");
  conversation += wire::encode(open).head;
  v1::Envelope subscribe;
  subscribe.mutable_subscribe()->mutable_mesh();
  conversation += wire::encode(subscribe).head;
  for (std::size_t length = 0; length <= conversation.size(); ++length) {
    RawClient client(server);
    client.send(conversation.substr(0, length));
  }
  expect_alive(server);
}

}  // namespace
}  // namespace ecorche::server
