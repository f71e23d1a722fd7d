// SPDX-License-Identifier: Apache-2.0
// Values that a field cannot have are refused, and named.
#include <limits>

#include <ecorche/wire/convert.hpp>
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

// What the request is answered with, where that is no success.
Status answer_to(TestClient& client, v1::Envelope request) {
  request.set_request_id(77);
  client.client().send(request);
  const v1::Envelope got = client.next([](const v1::Envelope& e) { return e.request_id() == 77; }).envelope;
  return got.has_status() ? wire::from_proto(got.status()) : Status{};
}

bool status_says(const Status& status, const std::string& part) {
  return status.message.find(part) != std::string::npos;
}

TEST(Refused, SkinningThatThereIsNot) {
  const TestServer server;
  TestClient client(server);
  for (const int skinning : {77, 4, -1}) {
    v1::Envelope update = client.update(1, client.bent(0.1));
    update.mutable_pose_update()->set_skinning(static_cast<v1::Skinning>(skinning));
    client.client().send(update);
    const v1::PoseAck ack = client.next_ack();
    EXPECT_EQ(ack.status().code(), static_cast<std::uint32_t>(StatusCode::invalid_argument)) << skinning;
    EXPECT_NE(ack.status().message().find("pose: skinning " + std::to_string(skinning) + " (send 0 to 3"),
              std::string::npos)
        << ack.status().message();
  }
  v1::Envelope update = client.update(1, client.bent(0.1));
  update.mutable_pose_update()->set_skinning(v1::SKINNING_LBS);
  client.client().send(update);
  EXPECT_EQ(client.next_ack().status().code(), 0U);
}

TEST(Refused, OtherNumbersThatStandForNothing) {
  const TestServer server;
  TestClient client(server);
  for (const int number : {-1, 9}) {
    v1::Envelope mesh, volume, probe;
    mesh.mutable_subscribe()->mutable_mesh()->set_encoding(static_cast<v1::Encoding>(number));
    EXPECT_TRUE(status_says(answer_to(client, mesh), "encoding " + std::to_string(number)));
    volume.mutable_subscribe()->mutable_volume()->set_volume("ct");
    volume.mutable_subscribe()->mutable_volume()->set_deformer(static_cast<v1::Deformer>(number));
    EXPECT_TRUE(status_says(answer_to(client, volume), "deformer " + std::to_string(number)));
    probe.mutable_probe_points()->set_direction(static_cast<v1::ProbePoints::Direction>(number));
    EXPECT_TRUE(status_says(answer_to(client, probe), "no direction"));
  }
}

TEST(Refused, PingsThatAreNoPings) {
  const TestServer server;
  TestClient client(server);
  v1::Envelope ping;
  ping.mutable_ping()->set_data(std::string(65, 'x'));
  const Status status = answer_to(client, ping);
  EXPECT_EQ(status.code, StatusCode::invalid_argument);
  EXPECT_TRUE(status_says(status, "ping: 65 bytes of data (send at most 64)")) << status.message;
  ping.mutable_ping()->mutable_data()->resize(64);
  EXPECT_EQ(client.client().call(ping).envelope.pong().data(), ping.ping().data());
}

TEST(Refused, MeshRegionsThatShowNothing) {
  const TestServer server;
  TestClient client(server);
  v1::Envelope request;
  v1::MeshSelection& mesh = *request.mutable_subscribe()->mutable_mesh();
  v1::Box& box = *mesh.mutable_region();
  box.mutable_min()->set_x(3);
  box.mutable_max()->set_x(3);
  for (const std::uint32_t level : {0U, 2U}) {
    mesh.set_level(level);
    const Status status = answer_to(client, request);
    EXPECT_EQ(status.code, StatusCode::invalid_argument);
    EXPECT_TRUE(status_says(status, "no vertex of the tissues lies in the region")) << status.message;
  }
  for (auto* corner : {box.mutable_min(), box.mutable_max()}) {
    const double sign = corner == box.mutable_min() ? -1 : 1;
    corner->set_x(1000 * sign);
    corner->set_y(1000 * sign);
    corner->set_z(1000 * sign);
  }
  EXPECT_TRUE(client.client().call(request).envelope.has_subscribed());
}

// A pose may be ahead of the last by so much, so that none is the last of all.
TEST(Refused, PosesThatLeaveNoNumbersForTheNext) {
  constexpr std::uint64_t kAhead = std::uint64_t{1} << 24U;
  const TestServer server;
  TestClient client(server, "shared");
  v1::Envelope play;
  play.mutable_play_clip()->set_name("turning");
  for (const std::uint64_t sequence : {(std::uint64_t{1} << 63U) - 1, kAhead + 1}) {
    client.send(sequence, client.bent(0.1));
    const v1::Status status = client.next_ack().status();
    EXPECT_EQ(status.code(), static_cast<std::uint32_t>(StatusCode::out_of_range));
    EXPECT_NE(status.message().find("(skip less than 2^24)"), std::string::npos) << status.message();
  }
  client.client().call(play);
  EXPECT_LT(client.next_ack().sequence(), kAhead);
  v1::Envelope release, claim;
  release.mutable_release_control();
  claim.mutable_claim_control();
  client.client().call(release);
  TestClient next(server, "shared");
  ASSERT_EQ(next.opened().role(), v1::ROLE_CONTROLLER);
  next.subscribe_mesh();
  next.send(kAhead, next.bent(0.1));
  next.next_mesh(kAhead);
  next.send(2 * kAhead, next.bent(0.2));
  next.next_mesh(2 * kAhead);
}

}  // namespace
}  // namespace ecorche::server
