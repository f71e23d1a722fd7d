// SPDX-License-Identifier: Apache-2.0
// Every encoding of meshes against offline posing, within its bound.
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/wire/mesh_decoder.hpp>
#include "runtime/server/session/mesh_stream.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

struct OfflineEncoded {
  explicit OfflineEncoded(const Pose& pose, const Model& model = test::toy_model())
      : poser(std::make_shared<const Model>(model)),
        body(poser.make_frame({.positions = true, .quantised = true, .normals = true})) {
    EXPECT_TRUE(poser.run(pose, runtime::Skinning::cor, poser.all_tissues(), body).ok());
  }
  runtime::BodyPoser poser;
  runtime::PosedBody body;
};

// Subscribes to all tissues; returns the subscription.
std::uint32_t subscribe(TestClient& client, v1::Encoding encoding, bool normals = false) {
  v1::Envelope request;
  request.mutable_subscribe()->mutable_mesh()->set_encoding(encoding);
  request.mutable_subscribe()->mutable_mesh()->set_normals(normals);
  return client.client().call(request).envelope.subscribed().subscription();
}

// The bound of docs/reference/protocol.md: half a step, and the rounding of float32.
void expect_within_bound(const std::vector<wire::DecodedTissue>& tissues, const OfflineEncoded& offline) {
  ASSERT_EQ(tissues.size(), offline.body.tissues.size());
  double worst = 0;
  for (const wire::DecodedTissue& tissue : tissues) {
    const std::vector<float>& expected = offline.body.tissues[tissue.tissue];
    ASSERT_EQ(tissue.positions.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double off = std::abs(static_cast<double>(tissue.positions[i]) - expected[i]);
      ASSERT_LE(off, offline.body.box.step / 2 + 4e-7 * std::abs(expected[i]) + 1e-4);
      worst = std::max(worst, off);
    }
  }
  EXPECT_GT(worst, 0);
}

TEST(Encodings, QuantisedFramesAreOfflinePosingWithinHalfAStep) {
  for (const v1::Encoding encoding : {v1::ENCODING_U16, v1::ENCODING_U16_DELTA}) {
    const TestServer server;
    TestClient client(server);
    subscribe(client, encoding);
    wire::MeshDecoder decoder;
    std::vector<wire::DecodedTissue> tissues;
    const wire::Frame rest = client.next_mesh(0);
    ASSERT_TRUE(decoder.decode(rest.envelope.mesh_frame(), rest.payload, tissues).ok());
    for (std::uint64_t sequence = 1; sequence < 20; ++sequence) {
      Pose pose = client.bent(0.05 * static_cast<double>(sequence));
      pose.root_translation.x() = 1000.0 * static_cast<double>(sequence);  // a walk
      client.send(sequence, pose);
      const wire::Frame frame = client.next_mesh(sequence);
      const v1::MeshFrame& mesh = frame.envelope.mesh_frame();
      EXPECT_EQ(mesh.encoding(), encoding);
      ASSERT_TRUE(decoder.decode(mesh, frame.payload, tissues).ok());
      const OfflineEncoded offline(pose);
      expect_within_bound(tissues, offline);
      // And the very numbers of the kernels.
      for (const wire::DecodedTissue& tissue : tissues)
        EXPECT_EQ(tissue.numbers, offline.body.quantised[tissue.tissue]);
      EXPECT_EQ(mesh.box().step(), offline.body.box.step);
      EXPECT_EQ(mesh.box().low_x(), offline.body.box.low[0]);
    }
  }
}

// Arrays that frames keep and bodies get back are those of the same selection, or nobody's.
TEST(Encodings, Float32OfSeveralSelectionsInTurn) {
  const TestServer server;
  TestClient all(server), one(server), both(server);
  const std::string name = test::toy_model().tissues.back().name;
  const auto subscribe_one = [&](TestClient& client) {
    v1::Envelope request;
    request.mutable_subscribe()->mutable_mesh()->set_encoding(v1::ENCODING_F32);
    request.mutable_subscribe()->mutable_mesh()->add_tissues(name);
    client.client().call(request);
  };
  subscribe(all, v1::ENCODING_F32);
  subscribe_one(one);
  subscribe(both, v1::ENCODING_F32);
  subscribe_one(both);
  wire::MeshDecoder decoder;
  std::vector<wire::DecodedTissue> tissues;
  for (std::uint64_t sequence = 1; sequence < 8; ++sequence) {
    std::size_t angle = sequence;
    for (TestClient* client : {&all, &one, &both}) {
      const Pose pose = client->bent(0.05 * static_cast<double>(++angle));
      client->send(sequence, pose);
      const OfflineEncoded offline(pose);
      for (int i = 0; i < (client == &both ? 2 : 1); ++i) {
        const wire::Frame frame = client->next_mesh(sequence);
        ASSERT_TRUE(decoder.decode(frame.envelope.mesh_frame(), frame.payload, tissues).ok());
        EXPECT_EQ(frame.envelope.mesh_frame().encoding(), v1::ENCODING_F32);
        for (const wire::DecodedTissue& tissue : tissues)
          EXPECT_EQ(tissue.positions, offline.body.tissues[tissue.tissue]) << sequence << " " << i;
      }
    }
  }
}

TEST(Encodings, DeltasFollowOneKeyframeAndTheNextComesInTime) {
  const TestServer server;
  TestClient client(server);
  subscribe(client, v1::ENCODING_U16_DELTA);
  const std::uint64_t first = client.next_mesh(0).envelope.mesh_frame().keyframe();
  EXPECT_GT(first, 0U);
  std::uint64_t keyframes = 0, deltas = 0;
  for (std::uint64_t sequence = 1; sequence <= MeshStream::keyframe_interval + 5; ++sequence) {
    client.send(sequence, client.bent(0.05 + 1e-4 * static_cast<double>(sequence)));  // deltas must not grow
    const wire::Frame frame = client.next_mesh(sequence);
    const v1::MeshFrame& mesh = frame.envelope.mesh_frame();
    mesh.keyframe() == mesh.frame() ? ++keyframes : ++deltas;
  }
  EXPECT_EQ(keyframes, 1U);
  EXPECT_EQ(deltas, MeshStream::keyframe_interval + 4);
}

TEST(Encodings, WhoJoinsGetsAKeyframeAtOnce) {
  const TestServer server;
  TestClient poser(server, "shared");
  subscribe(poser, v1::ENCODING_U16_DELTA);
  for (std::uint64_t sequence = 1; sequence < 5; ++sequence) {
    poser.send(sequence, poser.bent(0.01 * static_cast<double>(sequence)));
    poser.next_mesh(sequence);
  }
  TestClient observer(server, "shared");
  subscribe(observer, v1::ENCODING_U16_DELTA);
  const wire::Frame frame = observer.next_mesh(4);
  EXPECT_EQ(frame.envelope.mesh_frame().keyframe(), frame.envelope.mesh_frame().frame());
  wire::MeshDecoder decoder;
  std::vector<wire::DecodedTissue> tissues;
  ASSERT_TRUE(decoder.decode(frame.envelope.mesh_frame(), frame.payload, tissues).ok());
  expect_within_bound(tissues, OfflineEncoded(poser.bent(0.04)));
}

// A free joint can carry a part of the body out of any box: then the frame is exact instead.
TEST(Encodings, WhatDoesNotFitTheBoxComesAsFloat32) {
  Model loose = test::toy_model();
  loose.rig.skeleton.segments[1].joint.kind = JointKind::free;
  const TestServer server({}, loose);
  TestClient client(server);
  subscribe(client, v1::ENCODING_U16_DELTA);
  wire::MeshDecoder decoder;
  std::vector<wire::DecodedTissue> tissues;
  const wire::Frame rest = client.next_mesh(0);
  ASSERT_TRUE(decoder.decode(rest.envelope.mesh_frame(), rest.payload, tissues).ok());
  Pose pose = client.bent(0.1);
  pose.translation[1] = {5e4, 0, 0};
  client.send(1, pose);
  const wire::Frame frame = client.next_mesh(1);
  EXPECT_EQ(frame.envelope.mesh_frame().encoding(), v1::ENCODING_F32);
  EXPECT_FALSE(frame.envelope.mesh_frame().has_box());
  ASSERT_TRUE(decoder.decode(frame.envelope.mesh_frame(), frame.payload, tissues).ok());
  const OfflineEncoded offline(pose, loose);
  for (const wire::DecodedTissue& tissue : tissues)
    EXPECT_EQ(tissue.positions, offline.body.tissues[tissue.tissue]);
  // And back: the keyframe still counts.
  client.send(2, client.bent(0.2));
  const wire::Frame back = client.next_mesh(2);
  EXPECT_EQ(back.envelope.mesh_frame().encoding(), v1::ENCODING_U16_DELTA);
  ASSERT_TRUE(decoder.decode(back.envelope.mesh_frame(), back.payload, tissues).ok());
  expect_within_bound(tissues, OfflineEncoded(client.bent(0.2), loose));
}

TEST(Encodings, NormalsAreThoseOfThePosedSurfaceWithinADegree) {
  for (const v1::Encoding encoding : {v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA}) {
    const TestServer server;
    TestClient client(server);
    subscribe(client, encoding, true);
    wire::MeshDecoder decoder;
    std::vector<wire::DecodedTissue> tissues;
    for (std::uint64_t sequence = 0; sequence < 3; ++sequence) {
      const Pose pose = client.bent(0.3 * static_cast<double>(sequence));
      if (sequence > 0) client.send(sequence, pose);
      const wire::Frame frame = client.next_mesh(sequence);
      ASSERT_TRUE(decoder.decode(frame.envelope.mesh_frame(), frame.payload, tissues).ok());
      const OfflineEncoded offline(pose);
      for (const wire::DecodedTissue& tissue : tissues) {
        const std::vector<std::int16_t>& expected = offline.body.normals[tissue.tissue];
        ASSERT_EQ(tissue.normals.size(), expected.size());
        for (std::size_t i = 0; i < expected.size(); i += 3) {
          double cosine = 0, length = 0;
          for (std::size_t c = 0; c < 3; ++c) {
            cosine += tissue.normals[i + c] * expected[i + c] / 32767.0;
            length += std::abs(expected[i + c]);
          }
          EXPECT_GE(length == 0 ? 1 : cosine, std::cos(1.01 * M_PI / 180));
        }
      }
    }
  }
}

TEST(Encodings, SubscriptionsOfOneSessionDoNotDisturbEachOther) {
  const TestServer server;
  TestClient client(server);
  const std::uint32_t exact = client.subscribe_mesh(), packed = subscribe(client, v1::ENCODING_U16_DELTA),
                      with_normals = subscribe(client, v1::ENCODING_U16, true);
  std::map<std::uint32_t, wire::MeshDecoder> decoders;
  std::vector<wire::DecodedTissue> tissues;
  for (std::uint64_t sequence = 0; sequence < 6; ++sequence) {
    const Pose pose = client.bent(0.1 * static_cast<double>(sequence));
    if (sequence > 0) client.send(sequence, pose);
    const OfflineEncoded offline(pose);
    std::set<std::uint32_t> left{exact, packed, with_normals};
    while (!left.empty()) {
      const wire::Frame frame = client.next_mesh(sequence);
      const std::uint32_t id = frame.envelope.mesh_frame().subscription();
      left.erase(id);
      ASSERT_TRUE(decoders[id].decode(frame.envelope.mesh_frame(), frame.payload, tissues).ok());
      for (const wire::DecodedTissue& tissue : tissues) {
        EXPECT_EQ(tissue.normals.empty(), id != with_normals);
        if (id == exact) {
          EXPECT_EQ(tissue.positions, offline.body.tissues[tissue.tissue]);
        } else {
          EXPECT_EQ(tissue.numbers, offline.body.quantised[tissue.tissue]);
        }
      }
    }
  }
}

}  // namespace
}  // namespace ecorche::server
