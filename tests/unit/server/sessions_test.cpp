// SPDX-License-Identifier: Apache-2.0
// Sessions: who may pose, who sees what.
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

TEST(Sessions, TheCreatorPosesAndAnObserverWatches) {
  const TestServer server;
  TestClient creator(server, "shared");
  TestClient observer(server, "shared");
  EXPECT_EQ(creator.opened().role(), v1::ROLE_CONTROLLER);
  EXPECT_EQ(observer.opened().role(), v1::ROLE_OBSERVER);
  const std::uint32_t a = creator.subscribe_mesh();
  const std::uint32_t b = observer.subscribe_mesh();
  EXPECT_EQ(a, b);  // the same spec: encoded once

  creator.send(1, creator.bent(0.4));
  const wire::Frame mine = creator.next_mesh(1);
  const wire::Frame theirs = observer.next_mesh(1);
  EXPECT_EQ(mine.payload, theirs.payload);
  EXPECT_EQ(mine.envelope.SerializeAsString(), theirs.envelope.SerializeAsString());

  observer.send(1, observer.bent(0.1));
  const v1::PoseAck refused = observer.next_ack();
  EXPECT_EQ(refused.status().code(), static_cast<std::uint32_t>(StatusCode::permission_denied));
  EXPECT_NE(refused.status().message().find("shared"), std::string::npos);
}

TEST(Sessions, ALateObserverSeesThePresentPose) {
  const TestServer server;
  TestClient creator(server, "shared");
  creator.subscribe_mesh();
  creator.send(7, creator.bent(0.4));
  const wire::Frame shown = creator.next_mesh(7);
  TestClient late(server, "shared");
  late.subscribe_mesh();
  EXPECT_EQ(late.next_mesh(7).payload, shown.payload);
}

TEST(Sessions, UnnamedOnesAreOnesOwn) {
  const TestServer server;
  TestClient a(server);
  TestClient b(server);
  EXPECT_NE(a.opened().session(), b.opened().session());
  EXPECT_EQ(b.opened().role(), v1::ROLE_CONTROLLER);
  a.subscribe_mesh();
  b.subscribe_mesh();
  a.send(1, a.bent(0.2));
  b.send(1, b.bent(0.9));
  EXPECT_NE(a.next_mesh(1).payload, b.next_mesh(1).payload);
}

v1::Envelope open(const std::string& model, const std::string& session) {
  v1::Envelope envelope;
  envelope.mutable_open_model()->set_model(model);
  envelope.mutable_open_model()->set_session(session);
  return envelope;
}

TEST(Sessions, OddRequestsAreRefused) {
  const TestServer server;
  TestClient creator(server, "shared");
  client::Client client(server.address(), "test");
  EXPECT_EQ(error_of_call(client, open("nobody", "")), ErrorKind::usage);         // NOT_FOUND
  EXPECT_EQ(error_of_call(client, open("toy", "Shared!")), ErrorKind::protocol);  // INVALID_ARGUMENT
  EXPECT_EQ(error_of_call(client, open("toy", std::string(65, 'a'))), ErrorKind::protocol);
  EXPECT_EQ(error_of_call(client, open("twin", "shared")), ErrorKind::protocol);  // FAILED_PRECONDITION
  // None of this hurt: the connection opens what is right.
  EXPECT_EQ(client.call(open("toy", "shared")).envelope.model_opened().role(), v1::ROLE_OBSERVER);
}

TEST(Sessions, TheirNumberIsLimited) {
  Limits limits;
  limits.sessions = 2;
  const TestServer server(limits);
  TestClient a(server, "a");
  auto b = std::make_unique<TestClient>(server);
  client::Client client(server.address(), "test");
  EXPECT_EQ(error_of_call(client, open("toy", "c")), ErrorKind::temporary);  // RESOURCE_EXHAUSTED
  client.call(open("toy", "a"));
  // An unnamed session ends with its connection and makes room.
  b.reset();
  client::Client again(server.address(), "test");
  ErrorKind kind = ErrorKind::temporary;
  for (int i = 0; i < 200 && kind == ErrorKind::temporary; ++i) {
    kind = error_of_call(again, open("toy", "c"));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(kind, ErrorKind::internal);  // no error
}

TEST(Sessions, ANamedOneKeepsItsPoseAndItsControlForAWhile) {
  Limits limits;
  limits.linger_seconds = 100;
  const TestServer server(limits);
  {
    TestClient creator(server, "kept");
    creator.subscribe_mesh();
    creator.send(9, creator.bent(0.4));
    creator.next_mesh(9);
  }
  TestClient next(server, "kept");
  EXPECT_EQ(next.opened().role(), v1::ROLE_OBSERVER);
  next.subscribe_mesh();
  next.next_mesh(9);
}

TEST(Sessions, ControlThatLapsedGoesToTheNextWhoOpens) {
  Limits limits;
  limits.linger_seconds = 0;
  const TestServer server(limits);
  auto creator = std::make_unique<TestClient>(server, "open");
  TestClient observer(server, "open");
  EXPECT_EQ(observer.opened().role(), v1::ROLE_OBSERVER);
  creator.reset();
  v1::Role role = v1::ROLE_OBSERVER;
  for (int i = 0; i < 200 && role == v1::ROLE_OBSERVER; ++i) {
    role = TestClient(server, "open").opened().role();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(role, v1::ROLE_CONTROLLER);
}

TEST(Sessions, BadPosesAreAcknowledgedWithTheirReason) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  client.send(5, client.bent(0.1));
  EXPECT_EQ(client.next_ack().status().code(), 0U);

  const auto code_of = [&](const v1::Envelope& envelope) {
    client.client().send(envelope);
    return static_cast<StatusCode>(client.next_ack().status().code());
  };
  EXPECT_EQ(code_of(client.update(5, client.bent(0.1))), StatusCode::out_of_range);
  EXPECT_EQ(code_of(client.update(4, client.bent(0.1))), StatusCode::out_of_range);
  v1::Envelope other_rig = client.update(6, client.bent(0.1));
  other_rig.mutable_pose_update()->set_rig_digest(client.opened().rig_digest() ^ 1);
  EXPECT_EQ(code_of(other_rig), StatusCode::invalid_argument);
  v1::Envelope short_pose = client.update(6, client.bent(0.1));
  short_pose.mutable_pose_update()->mutable_rotation()->RemoveLast();
  EXPECT_EQ(code_of(short_pose), StatusCode::invalid_argument);
  v1::Envelope not_a_number = client.update(6, client.bent(0.1));
  not_a_number.mutable_pose_update()->set_rotation(3, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(code_of(not_a_number), StatusCode::invalid_argument);
  // A refused pose does not count: its number is still free, and the body still moves.
  EXPECT_EQ(code_of(client.update(6, client.bent(0.2))), StatusCode::ok);
}

// Clips count on from a client's poses, and never come to 0, which is the rest pose to every session.
TEST(Sessions, NumbersOfPosesLeaveRoomForThoseOfClips) {
  constexpr std::uint64_t kHalf = std::uint64_t{1} << 63U;
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  for (const std::uint64_t large : {~std::uint64_t{0}, kHalf}) {
    client.send(large, client.bent(0.1));
    const v1::Status status = client.next_ack().status();
    EXPECT_EQ(status.code(), static_cast<std::uint32_t>(StatusCode::out_of_range));
    EXPECT_NE(status.message().find("(stay below 2^63)"), std::string::npos) << status.message();
  }
}

}  // namespace
}  // namespace ecorche::server
