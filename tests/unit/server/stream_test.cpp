// SPDX-License-Identifier: Apache-2.0
// What a well-behaved client gets.
#include <cstring>
#include <set>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/quality_meter.hpp>
#include <ecorche/runtime/resample.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include <ecorche/wire/convert.hpp>
#include "proto/arrays.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

// Offline posing, the oracle of every frame.
struct Offline {
  explicit Offline(const Pose& pose, runtime::Skinning skinning = runtime::Skinning::cor)
      : poser(std::make_shared<const Model>(test::toy_model())), body(poser.make_frame()) {
    EXPECT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body).ok());
  }
  runtime::BodyPoser poser;
  runtime::PosedBody body;
};

void expect_equal(const wire::Frame& frame, const Offline& offline) {
  ASSERT_TRUE(frame.envelope.has_mesh_frame());
  for (const v1::MeshArray& array : frame.envelope.mesh_frame().arrays()) {
    std::span<const float> positions;
    ASSERT_TRUE(wire::find(array.array(), frame.payload, 3, positions));
    const std::vector<float>& expected = offline.body.tissues[array.tissue()];
    ASSERT_EQ(positions.size(), expected.size());
    EXPECT_EQ(std::memcmp(positions.data(), expected.data(), positions.size_bytes()), 0)
        << "tissue " << array.tissue();
  }
}

TEST(Stream, HelloTellsLimitsAndEncodings) {
  const TestServer server;
  client::Client client(server.address(), "test");
  EXPECT_EQ(client.server().protocol(), 1U);
  EXPECT_EQ(client.server().server(), "ecorche test");
  EXPECT_EQ(client.server().limits().connections(), 256U);
  EXPECT_EQ(client.server().limits().payload_bytes(), 1U << 20);
  const auto& encodings = client.server().encodings();
  EXPECT_EQ(std::vector<int>(encodings.begin(), encodings.end()),
            (std::vector<int>{v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA}));
}

TEST(Stream, ModelsAreListed) {
  const TestServer server;
  client::Client client(server.address(), "test");
  v1::Envelope request;
  request.mutable_list_models();
  const v1::ModelList list = client.call(request).envelope.model_list();
  ASSERT_EQ(list.models_size(), 2);
  EXPECT_EQ(list.models(0).name(), "toy");
  EXPECT_EQ(list.models(0).identity(), model_file::identity(server.model()));
  EXPECT_EQ(list.models(0).nodes(), server.model().node_count());
  EXPECT_EQ(list.models(0).volumes_size(), static_cast<int>(server.model().volumes.size()));
}

TEST(Stream, OpeningGivesTheWholeTopologyOnce) {
  const TestServer server;
  client::Client client(server.address(), "test");
  v1::Envelope request;
  request.mutable_open_model();  // the first one
  const wire::Frame frame = client.call(request);
  const v1::ModelOpened& opened = frame.envelope.model_opened();
  const Model& model = server.model();
  EXPECT_EQ(opened.model(), "toy");
  EXPECT_EQ(opened.role(), v1::ROLE_CONTROLLER);
  EXPECT_EQ(opened.rig_digest(), model_file::rig_digest(model.rig));
  EXPECT_EQ(opened.topology_digest(), model_file::topology_digest(model));
  ASSERT_EQ(opened.tissues_size(), static_cast<int>(model.tissues.size()));
  for (int i = 0; i < opened.tissues_size(); ++i) {
    const Tissue& tissue = model.tissues[static_cast<std::size_t>(i)];
    EXPECT_EQ(opened.tissues(i).name(), tissue.name);
    EXPECT_EQ(opened.tissues(i).group(), group_name(tissue.group));
    EXPECT_EQ(opened.tissues(i).vertices(), static_cast<std::uint64_t>(tissue.V.rows()));
    std::span<const std::uint32_t> corners;
    ASSERT_TRUE(wire::find(opened.tissues(i).triangles(), frame.payload, 3, corners));
    ASSERT_EQ(corners.size(), static_cast<std::size_t>(tissue.F.size()));
    EXPECT_EQ(std::memcmp(corners.data(), tissue.F.data(), corners.size_bytes()), 0);
  }
  ASSERT_EQ(opened.volumes_size(), static_cast<int>(model.volumes.size()));
  ImageGrid grid;
  ASSERT_TRUE(wire::from_proto(opened.volumes(0).grid(), grid).ok());
  EXPECT_EQ(grid, model.volumes[0].image.grid);
  // Once: another body needs another connection.
  EXPECT_EQ(error_of_call(client, request), ErrorKind::protocol);
}

TEST(Stream, TrianglesCanBeLeftOut) {
  const TestServer server;
  client::Client client(server.address(), "test");
  v1::Envelope request;
  request.mutable_open_model()->set_without_triangles(true);
  const wire::Frame frame = client.call(request);
  EXPECT_TRUE(frame.payload.empty());
  EXPECT_FALSE(frame.envelope.model_opened().tissues(0).has_triangles());
}

TEST(Stream, ASubscriptionStartsWithTheRestPose) {
  const TestServer server;
  TestClient client(server);
  const std::uint32_t subscription = client.subscribe_mesh();
  const wire::Frame frame = client.next_mesh(0);
  EXPECT_EQ(frame.envelope.mesh_frame().subscription(), subscription);
  EXPECT_EQ(frame.envelope.mesh_frame().topology_digest(), client.opened().topology_digest());
  EXPECT_EQ(frame.envelope.mesh_frame().arrays_size(), client.opened().tissues_size());
  expect_equal(frame, Offline(client.bent(0)));
}

TEST(Stream, EveryFrameEqualsOfflinePosingForEveryMethod) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  std::uint64_t sequence = 0;
  const std::pair<v1::Skinning, runtime::Skinning> methods[] = {
      {v1::SKINNING_UNSPECIFIED, runtime::Skinning::cor},
      {v1::SKINNING_COR, runtime::Skinning::cor},
      {v1::SKINNING_DQS, runtime::Skinning::dqs},
      {v1::SKINNING_LBS, runtime::Skinning::lbs}};
  for (const auto& [wanted, method] : methods) {
    for (const double angle : {-1.0, 0.3, 0.7}) {
      v1::Envelope envelope = client.update(++sequence, client.bent(angle));
      envelope.mutable_pose_update()->set_skinning(wanted);
      client.client().send(envelope);
      expect_equal(client.next_mesh(sequence), Offline(client.bent(angle), method));
    }
  }
}

// Jobs take up bodies that others left, of other tissues and encodings.
TEST(Stream, SessionsLeaveNothingBehindInTheBodiesTheyShare) {
  const TestServer server;
  TestClient one(server), other(server), third(server);
  one.subscribe_mesh({"skin"});
  other.subscribe_mesh();
  v1::Envelope quantised;
  quantised.mutable_subscribe()->mutable_mesh()->set_encoding(v1::ENCODING_U16);
  quantised.mutable_subscribe()->mutable_mesh()->set_normals(true);
  third.client().call(quantised);
  for (std::uint64_t sequence = 1; sequence <= 6; ++sequence) {
    const double angle = 0.1 * static_cast<double>(sequence);
    one.send(sequence, one.bent(angle));
    other.send(sequence, other.bent(-angle));
    third.send(sequence, third.bent(2 * angle));
    expect_equal(one.next_mesh(sequence), Offline(one.bent(angle)));
    expect_equal(other.next_mesh(sequence), Offline(other.bent(-angle)));
    EXPECT_EQ(third.next_mesh(sequence).envelope.mesh_frame().encoding(), v1::ENCODING_U16);
  }
}

TEST(Stream, OnlyTheTissuesAskedFor) {
  const TestServer server;
  TestClient client(server);
  const std::string last = client.opened().tissues(client.opened().tissues_size() - 1).name();
  client.subscribe_mesh({last});
  const wire::Frame frame = client.next_mesh(0);
  ASSERT_EQ(frame.envelope.mesh_frame().arrays_size(), 1);
  EXPECT_EQ(frame.envelope.mesh_frame().arrays(0).tissue(),
            static_cast<std::uint32_t>(client.opened().tissues_size() - 1));
}

TEST(Stream, VolumesEqualOfflineResampling) {
  const TestServer server;
  TestClient client(server);
  for (int row = 0; row < client.opened().volumes_size(); ++row) {
    const std::uint32_t subscription = client.subscribe_volume(client.opened().volumes(row).name());
    const Pose pose = client.bent(0.6);
    client.send(static_cast<std::uint64_t>(row) + 1, pose);
    const wire::Frame frame = client.next([&](const v1::Envelope& e) {
      return e.volume_frame().subscription() == subscription &&
             e.volume_frame().pose_sequence() == static_cast<std::uint64_t>(row) + 1;
    });
    const v1::VolumeFrame& volume = frame.envelope.volume_frame();
    EXPECT_EQ(volume.status().code(), 0U);
    EXPECT_EQ(volume.volume(), static_cast<std::uint32_t>(row));

    const Offline offline(pose);
    const ModelVolume& rest = server.model().volumes[static_cast<std::size_t>(row)];
    const ImageGrid grid = runtime::grow_to(rest.image.grid, offline.body.nodes);
    const Image expected = runtime::pose_volume(std::make_shared<const Model>(server.model()),
                                                offline.body.nodes, rest, runtime::Sampling::trilinear, grid);
    ImageGrid sent;
    ASSERT_TRUE(wire::from_proto(volume.grid(), sent).ok());
    EXPECT_EQ(sent, grid);
    std::span<const std::byte> voxels;
    ASSERT_TRUE(wire::find(volume.voxels(), frame.payload, voxels));
    ASSERT_EQ(voxels.size(), expected.bytes.size());
    EXPECT_EQ(std::memcmp(voxels.data(), expected.bytes.data(), voxels.size()), 0);
  }
}

TEST(Stream, AVolumeBeyondTheLimitIsRefusedAlone) {
  Limits limits;
  limits.volume_voxels = 10;
  const TestServer server(limits);
  TestClient client(server);
  client.subscribe_volume(client.opened().volumes(0).name());
  const wire::Frame frame = client.next([](const v1::Envelope& e) { return e.has_volume_frame(); });
  EXPECT_EQ(frame.envelope.volume_frame().status().code(),
            static_cast<std::uint32_t>(StatusCode::resource_exhausted));
  EXPECT_TRUE(frame.payload.empty());
}

TEST(Stream, QualityComesWhereItWasAskedFor) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh({}, true);
  client.send(1, client.bent(0.8));
  const wire::Frame frame = client.next_mesh(1);
  const v1::PoseQuality& quality = frame.envelope.mesh_frame().quality();
  const Offline offline(client.bent(0.8));
  const runtime::PoseQuality expected =
      runtime::QualityMeter(offline.poser.shared_model()).measure(offline.body, offline.poser.all_tissues());
  EXPECT_EQ(quality.verdict(), expected.pass ? v1::PoseQuality::VERDICT_PASS : v1::PoseQuality::VERDICT_WARN);
  EXPECT_EQ(quality.inverted_tets(), expected.inverted_tets);
  EXPECT_EQ(quality.min_det_f(), expected.min_det_f);
  EXPECT_EQ(quality.volume_change(), expected.volume_change);
  ASSERT_EQ(quality.tissues_size(), static_cast<int>(expected.tissues.size()));
  for (std::size_t t = 0; t < expected.tissues.size(); ++t)
    EXPECT_EQ(quality.tissues(static_cast<int>(t)).has_share(), expected.tissues[t].closed) << t;
  EXPECT_GT(quality.max_volume_change(), 0);
  EXPECT_EQ(frame.envelope.mesh_frame().clamped_size(), static_cast<int>(offline.body.clamped.size()));
}

TEST(Stream, ClampedJointsAreNamed) {
  const TestServer server;
  TestClient client(server);
  client.subscribe_mesh();
  Pose pose = client.bent(0);
  // A hinge turned about every axis: it cannot.
  pose.rotation[1] = Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 1, 1).normalized());
  client.send(1, pose);
  const v1::PoseAck ack = client.next_ack();
  EXPECT_EQ(ack.status().code(), 0U);
  ASSERT_EQ(ack.clamped_size(), 1);
  EXPECT_EQ(ack.clamped(0).joint(), 1U);
  EXPECT_EQ(ack.clamped(0).name(), server.model().rig.skeleton.segments[1].joint.name);
  EXPECT_GT(ack.clamped(0).removed(), 0.1);
}

TEST(Stream, UnsubscribingEndsTheFrames) {
  const TestServer server;
  TestClient client(server);
  const std::uint32_t subscription = client.subscribe_mesh();
  client.next_mesh(0);
  v1::Envelope request;
  request.mutable_unsubscribe()->set_subscription(subscription);
  client.client().call(request);
  client.send(1, client.bent(0.5));
  EXPECT_EQ(client.next_ack().sequence(), 1U);
  EXPECT_FALSE(client.client().receive(client::Clock::now() + std::chrono::milliseconds(200)));
  EXPECT_EQ(error_of_call(client.client(), request), ErrorKind::usage);  // NOT_FOUND
}

TEST(Stream, PingIsAnswered) {
  const TestServer server;
  client::Client client(server.address(), "test");
  v1::Envelope ping;
  ping.mutable_ping()->set_data("hello");
  EXPECT_EQ(client.call(ping).envelope.pong().data(), "hello");
}

// Every pose is shown or told as skipped: none is lost, whatever the rate.
TEST(Stream, TheNewestPoseWinsAndTheOthersAreTold) {
  Limits limits;
  limits.poses_per_second = 50;
  const TestServer server(limits);
  TestClient client(server);
  client.subscribe_mesh({client.opened().tissues(0).name()});
  constexpr std::uint64_t last = 200;
  for (std::uint64_t sequence = 1; sequence <= last; ++sequence)
    client.send(sequence, client.bent(0.001 * static_cast<double>(sequence)));
  std::set<std::uint64_t> seen;
  std::uint64_t skipped = 0;
  while (!seen.contains(last)) {
    const v1::PoseAck ack = client.next_ack();
    EXPECT_EQ(ack.status().code(), 0U);
    EXPECT_EQ(ack.skipped(), static_cast<std::uint64_t>(ack.skipped_sequences_size()));
    for (const std::uint64_t sequence : ack.skipped_sequences())
      EXPECT_TRUE(seen.insert(sequence).second) << sequence;
    EXPECT_TRUE(seen.insert(ack.sequence()).second);
    skipped += ack.skipped();
  }
  EXPECT_EQ(seen.size(), last);
  EXPECT_GT(skipped, last / 2);
}

}  // namespace
}  // namespace ecorche::server
