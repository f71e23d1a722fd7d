// SPDX-License-Identifier: Apache-2.0
// What is kept for subscriptions and probes is counted, and limited.
#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "runtime/server/session/retained_bytes.hpp"
#include "tests/unit/server/session_stage.hpp"
#include "tests/unit/server/test_server.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

constexpr std::uint64_t kPlenty = std::uint64_t{1} << 30;

Stage stage_with(std::uint64_t kept) {
  return Stage(v1::ENCODING_F32, kPlenty, test::toy_model(), kept);
}

std::uint64_t kept_by_scan(const Model& model) {
  const VolumeSpec spec;
  return kept_by(model, spec, rest_voxels(model, spec));
}

TEST(Kept, AVolumeCountsWhileSomebodyWatchesIt) {
  Stage stage = stage_with(kPlenty);
  const Model& model = stage.model->model();
  EXPECT_EQ(stage.memory.kept(), 0U) << "of a whole mesh in float32 nothing is kept";
  EXPECT_GT(kept_by_scan(model), 3 * model.volumes[0].image.bytes.size());
  const std::uint32_t first = stage.subscribe_volume(stage.watcher);
  EXPECT_EQ(stage.memory.kept(), kept_by_scan(model));
  stage.subscribe_volume(stage.watcher, true);
  EXPECT_EQ(stage.memory.kept(), kept_by_scan(model)) << "of a plane nothing is kept";
  Watcher other;
  stage.session->join(other);
  EXPECT_EQ(stage.subscribe_volume(other), first);
  EXPECT_EQ(stage.memory.kept(), kept_by_scan(model)) << "equal wants share a stream";
  stage.subscribe_volume(other, false, 30);
  EXPECT_EQ(stage.memory.kept(), 2 * kept_by_scan(model));

  stage.session->leave(other, false);
  EXPECT_EQ(stage.memory.kept(), kept_by_scan(model));
  EXPECT_TRUE(stage.session->unsubscribe(stage.watcher, first));
  EXPECT_EQ(stage.memory.kept(), 0U);
  EXPECT_EQ(stage.gone.size(), 2U) << "streams end elsewhere than on the I/O thread";
  EXPECT_TRUE(stage.session->unsubscribe(stage.watcher, 1));
  EXPECT_EQ(stage.gone.size(), 3U) << "a mesh's, too";
}

TEST(Kept, ARegionCountsAsLargeAsItIs) {
  const Model model = test::toy_model();
  const ImageGrid& grid = model.volumes[0].image.grid;
  VolumeSpec spec;
  spec.region = runtime::Region{grid.point(1, 2, 3), grid.point(2, 4, 6)};
  for (std::size_t a = 0; a < 3; ++a) {
    if (spec.region->low[a] > spec.region->high[a]) std::swap(spec.region->low[a], spec.region->high[a]);
  }
  EXPECT_EQ(rest_voxels(model, spec), 2U * 3 * 4);
  // A region that is larger than any volume may be: each of its frames says so, and nothing is made.
  Stage stage = stage_with(kPlenty);
  spec.region = runtime::Region{{-1e5, -1e5, -1e5}, {1e5, 1e5, 1e5}};
  EXPECT_TRUE(stage.session->subscribe(stage.watcher, {.id = 0, .spec = spec, .request = {}}));
  EXPECT_EQ(stage.memory.kept(), 0U);
}

// A keyframe and the deltas against it; parts of a mesh; never the whole of one that is sent as it is posed.
TEST(Kept, MeshesCountByTheirEncodingAndParts) {
  Stage stage = stage_with(kPlenty);
  const std::uint64_t vertices = static_cast<std::uint64_t>(stage.model->model().tissues[0].V.rows());
  const auto more_for = [&](const auto& change) {
    MeshSpec spec;
    spec.tissues = {0};
    change(spec);
    const std::uint64_t before = stage.memory.kept();
    EXPECT_TRUE(stage.session->subscribe(stage.watcher, {.id = 0, .spec = spec, .request = {}}));
    return stage.memory.kept() - before;
  };
  EXPECT_EQ(more_for([](MeshSpec& w) { w.normals = true; }), 0U);
  EXPECT_EQ(more_for([](MeshSpec& w) { w.encoding = v1::ENCODING_U16; }), 0U);
  const std::uint64_t deltas = more_for([](MeshSpec& w) { w.encoding = v1::ENCODING_U16_DELTA; });
  EXPECT_GE(deltas, 12 * vertices);
  EXPECT_EQ(more_for([](MeshSpec& w) { w.encoding = v1::ENCODING_U16_DELTA, w.max_rate = 30; }), deltas);
  const std::uint64_t part = more_for([](MeshSpec& w) { w.level = 1; });
  EXPECT_GT(part, 0U);
  EXPECT_GT(more_for([](MeshSpec& w) { w.level = 1, w.encoding = v1::ENCODING_U16; }), part);
  EXPECT_GT(more_for([](MeshSpec& w) { w.adaptive = true; }), part);
  EXPECT_GT(more_for([](MeshSpec& w) { w.control_nodes = true; }), 0U);
}

v1::Envelope for_scan(const TestServer& server, double rate) {
  v1::Envelope envelope;
  envelope.mutable_subscribe()->set_max_rate(rate);
  envelope.mutable_subscribe()->mutable_volume()->set_volume(server.model().volumes[0].name);
  return envelope;
}

std::uint32_t code_of(TestClient& client, const v1::Envelope& request, std::string* message = nullptr) {
  client.client().send(request);
  const wire::Frame answer =
      client.next([](const v1::Envelope& e) { return e.has_subscribed() || e.has_status(); });
  if (message) *message = answer.envelope.status().message();
  return answer.envelope.status().code();
}

TEST(Kept, WhatFindsNoRoomIsRefusedAlone) {
  Options options;
  options.http = Endpoint{};
  const std::uint64_t one = kept_by_scan(test::toy_model());
  options.limits.kept_bytes = 3 * one - 1;  // two, and room to grow
  options.limits.peer_share = options.limits.connection_share = 1;
  const TestServer server(options);
  TestClient client(server), other(server);
  EXPECT_EQ(client.client().server().limits().kept_bytes(), options.limits.kept_bytes);
  EXPECT_EQ(client.client().server().limits().record_bytes(), options.limits.record_bytes);
  v1::Envelope first = for_scan(server, 1), second = for_scan(server, 2), third = for_scan(server, 3);
  first.set_request_id(1), second.set_request_id(2), third.set_request_id(3);
  EXPECT_EQ(code_of(client, first), 0U);
  EXPECT_EQ(code_of(other, second), 0U);
  std::string message;
  EXPECT_EQ(code_of(client, third, &message), static_cast<std::uint32_t>(StatusCode::resource_exhausted));
  EXPECT_NE(message.find("what is kept for streams fills the server's memory for it"), std::string::npos);
  const std::string page = WebClient(server.http()).get("/metrics");
  EXPECT_NE(page.find("ecorche_limits_hit_total{limit=\"kept\"} 1"), std::string::npos) << page;
  EXPECT_NE(page.find("ecorche_kept_bytes " + std::to_string(2 * one)), std::string::npos) << page;
  // What keeps nothing is served, and so is whoever was.
  client.subscribe_mesh();
  client.send(1, client.bent(0.3));
  bool mesh = false, volume = false;
  client.next([&](const v1::Envelope& e) {
    mesh = mesh || (e.has_mesh_frame() && e.mesh_frame().pose_sequence() == 1);
    volume = volume || (e.has_volume_frame() && e.volume_frame().pose_sequence() == 1 &&
                        e.volume_frame().status().code() == 0);
    return mesh && volume;
  });
  v1::Envelope unsubscribe;
  unsubscribe.set_request_id(4);
  unsubscribe.mutable_unsubscribe()->set_subscription(1);
  EXPECT_EQ(code_of(client, unsubscribe), 0U);
  EXPECT_EQ(code_of(client, third), 0U);
}

// Its place is there, but for what others have the memory of by now.
TEST(Kept, WhoComesBackMayFindNoRoom) {
  Options options;
  options.limits.kept_bytes = kept_by_scan(test::toy_model());
  options.limits.peer_share = options.limits.connection_share = 1;
  const TestServer server(options);
  std::string token;
  {
    TestClient before(server);
    before.subscribe_volume(server.model().volumes[0].name);
    before.subscribe_mesh();
    token = before.client().server().resume_token();
  }
  TestClient other(server);
  v1::Envelope request = for_scan(server, 0);
  request.set_request_id(9);
  while (code_of(other, request) != 0) {
  }
  const client::Client back(server.address(), "test",
                            {.authorities = {}, .token = {}, .resume_token = token});
  const v1::Resumed& resumed = back.server().resumed();
  EXPECT_EQ(resumed.role(), v1::ROLE_CONTROLLER);
  ASSERT_EQ(resumed.subscriptions_size(), 1);
  EXPECT_EQ(resumed.subscriptions(0).was(), 2U);
}

// The answer to a probe of the stage's session.
struct Asking {
  Asking(Stage& on, bool many = false) {
    on.session->probe(
        [this](const std::shared_ptr<const ProbeFrame>& posed, const Status& why) {
          frame = posed;
          status = why;
          answered = true;
        },
        many);
    on.run_until([&] { return answered; });
  }
  std::shared_ptr<const ProbeFrame> frame;
  Status status;
  bool answered = false;
};

TEST(Kept, ProbesFindRoomOrAreTold) {
  const std::uint64_t tree = kept_by_probe(test::toy_model());
  Stage stage = stage_with(tree);
  {
    Asking first(stage);
    ASSERT_TRUE(first.frame);
    EXPECT_EQ(stage.memory.kept(), tree);
    // The only tree is still being asked: another pose has none, and the old one is not taken for it.
    stage.pose(1);
    stage.run_until([&] { return stage.session->poses().present().sequence == 1; });
    const Asking second(stage);
    EXPECT_FALSE(second.frame);
    EXPECT_EQ(second.status.code, StatusCode::resource_exhausted);
    EXPECT_NE(second.status.message.find("what is kept for streams and probes fills"), std::string::npos);
  }
  const Asking third(stage);
  ASSERT_TRUE(third.frame);
  EXPECT_EQ(third.frame->sequence, 1U);
  EXPECT_EQ(stage.memory.kept(), tree);
}

TEST(Kept, TreesAreForgottenWhenNobodyAsks) {
  Stage stage = stage_with(kPlenty);
  const auto now = Clock::now();
  const auto forgotten = [&](Clock::time_point then, std::size_t trees) {
    stage.run_until([&] {  // its job may not be over
      stage.session->forget_probes(then);
      return stage.gone.size() >= trees;
    });
    EXPECT_EQ(stage.gone.size(), trees);
    stage.gone.clear();
    EXPECT_EQ(stage.memory.kept(), 0U);
  };
  EXPECT_TRUE(Asking(stage).frame);
  stage.wait(milliseconds(50));
  stage.session->forget_probes(now + std::chrono::seconds(9));
  EXPECT_TRUE(stage.gone.empty());
  forgotten(now + std::chrono::seconds(60), 1);
  EXPECT_TRUE(Asking(stage).frame) << "made again";
  stage.session->leave(stage.watcher, false);
  forgotten(now, 2);  // with the mesh's stream
}

}  // namespace
}  // namespace ecorche::server
