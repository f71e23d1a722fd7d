// SPDX-License-Identifier: Apache-2.0
// The balls of a volume, told to a client and hung anew by it: over a real socket, beside the same offline.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/wire/convert.hpp>
#include "proto/arrays.hpp"
#include "runtime/spheres/pose_volume.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

template <class T>
std::vector<T> rows(const v1::Array& array, const wire::Payload& payload, std::uint32_t components = 1) {
  std::span<const T> found;
  EXPECT_TRUE(wire::find(array, payload, components, found));
  return {found.begin(), found.end()};
}

wire::Frame get_spheres(TestClient& client, const std::string& volume = "ct") {
  v1::Envelope request;
  request.mutable_get_spheres()->set_volume(volume);
  return client.client().call(request);
}

struct Hang {
  v1::Envelope envelope;
  std::shared_ptr<wire::Payload> payload = std::make_shared<wire::Payload>();

  explicit Hang(const std::string& volume = "ct") { envelope.mutable_hang_spheres()->set_volume(volume); }
  Hang& segment(const std::vector<std::int32_t>& values) {
    *envelope.mutable_hang_spheres()->mutable_segment() =
        wire::append(*payload, std::span<const std::int32_t>(values), 1);
    return *this;
  }
  Hang& joints(const std::vector<double>& values) {
    *envelope.mutable_hang_spheres()->mutable_joints() =
        wire::append(*payload, std::span<const double>(values), 3);
    return *this;
  }
  void send(TestClient& client) const { client.client().call(envelope, payload); }
};

std::string refusal(TestClient& client, const Hang& hang) {
  try {
    hang.send(client);
  } catch (const client::ServerError& error) {
    return error.problem();
  }
  return "nothing";
}

std::vector<double> flat(const std::vector<runtime::Vec3>& joints) {
  std::vector<double> out;
  for (const runtime::Vec3& joint : joints) out.insert(out.end(), joint.begin(), joint.end());
  return out;
}

runtime::Hanging own_hanging(const Model& model) {
  return runtime::hanging_of(runtime::spheres_for(model, model.volumes[0]), model.rig.skeleton);
}

// All on the first segment, and the tip's joint aside.
runtime::Hanging another_hanging(const Model& model) {
  runtime::Hanging out = own_hanging(model);
  for (std::size_t i = 0; i < out.segment.size(); i += 2) out.segment[i] = 0;
  out.joint[1][0] += 15;
  return out;
}

// The CT of a pose by balls that hang so.
Image refilled(const Model& model, const Pose& pose, const runtime::Hanging& hanging) {
  const runtime::BodyPoser poser(std::make_shared<const Model>(model));
  runtime::PosedBody body = poser.make_frame();
  EXPECT_TRUE(poser.run(pose, runtime::Skinning::cor, {}, body).ok());
  const ModelVolume& volume = model.volumes[0];
  const runtime::BallSet set = runtime::VolumeBalls(model, volume, hanging).at(body.segments);
  return runtime::refill(set, runtime::box_for(set, std::nullopt), volume.image, volume.background,
                         runtime::Sampling::trilinear);
}

void subscribe(TestClient& client) {
  v1::Envelope request;
  v1::VolumeSelection& selection = *request.mutable_subscribe()->mutable_volume();
  selection.set_volume("ct");
  selection.set_deformer(v1::DEFORMER_SPHERES);
  client.client().call(request);
}

// The next frame that shows these very voxels comes; what was made before may come first.
void expect_shown(TestClient& client, const Image& expected) {
  const auto until = client::Clock::now() + std::chrono::seconds(20);
  while (client::Clock::now() < until) {
    const wire::Frame frame = client.next([](const v1::Envelope& e) { return e.has_volume_frame(); });
    std::span<const std::byte> voxels;
    ASSERT_TRUE(wire::find(frame.envelope.volume_frame().voxels(), frame.payload, voxels));
    if (voxels.size() == expected.bytes.size() &&
        std::memcmp(voxels.data(), expected.bytes.data(), voxels.size()) == 0)
      return;
  }
  FAIL() << "no such frame came";
}

TEST(HungSpheres, AreToldAsTheModelHasThem) {
  const TestServer server;
  TestClient client(server);
  const wire::Frame frame = get_spheres(client);
  const v1::Spheres& told = frame.envelope.spheres();
  const VolumetricSkeleton& skeleton = runtime::spheres_for(server.model(), server.model().volumes[0]);
  EXPECT_EQ(told.name(), skeleton.name);
  ImageGrid grid;
  ASSERT_TRUE(wire::from_proto(told.grid(), grid).ok());
  EXPECT_EQ(grid, skeleton.grid);
  EXPECT_EQ(told.metric() == v1::Spheres::METRIC_EUCLIDEAN, skeleton.metric == DistanceMetric::euclidean);
  EXPECT_EQ(told.thinness(), skeleton.thinness);
  const auto voxels = rows<std::uint16_t>(told.voxels(), frame.payload, 3);
  ASSERT_EQ(voxels.size(), 3 * skeleton.size());
  for (std::size_t i = 0; i < skeleton.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_EQ(voxels[3 * i + axis], skeleton.voxel[i][axis]) << i;
  }
  EXPECT_EQ(rows<std::uint32_t>(told.distance(), frame.payload), skeleton.distance);
  EXPECT_EQ(rows<float>(told.deficit(), frame.payload), skeleton.deficit);
  EXPECT_EQ(told.has_parent(), !skeleton.parent.empty());
  EXPECT_EQ(rows<std::int32_t>(told.segment(), frame.payload), skeleton.segment);
  EXPECT_EQ(rows<double>(told.joints(), frame.payload, 3), flat(own_hanging(server.model()).joint));
  EXPECT_FALSE(told.by_hand());
}

TEST(HungSpheres, PoseTheirSessionAloneUntilTheyAreGivenBack) {
  const TestServer server;
  const Model& model = server.model();
  const runtime::Hanging own = own_hanging(model), other = another_hanging(model);
  TestClient client(server), elsewhere(server);
  const Pose pose = client.bent(0.6);
  const Image as_given = refilled(model, pose, own), by_hand = refilled(model, pose, other);
  ASSERT_NE(as_given.bytes, by_hand.bytes);
  for (TestClient* one : {&client, &elsewhere}) {
    subscribe(*one);
    one->send(1, pose);
    expect_shown(*one, as_given);
  }
  Hang().segment(other.segment).joints(flat(other.joint)).send(client);
  expect_shown(client, by_hand);
  const wire::Frame told = get_spheres(client);
  EXPECT_TRUE(told.envelope.spheres().by_hand());
  EXPECT_EQ(rows<std::int32_t>(told.envelope.spheres().segment(), told.payload), other.segment);
  EXPECT_EQ(rows<double>(told.envelope.spheres().joints(), told.payload, 3), flat(other.joint));
  // The next pose goes by them, too.
  const Pose next = client.bent(-0.4);
  client.send(2, next);
  expect_shown(client, refilled(model, next, other));
  // Elsewhere all is as it was.
  EXPECT_FALSE(get_spheres(elsewhere).envelope.spheres().by_hand());
  elsewhere.send(2, next);
  expect_shown(elsewhere, refilled(model, next, own));
  // What is absent is the model's own.
  Hang().segment(other.segment).send(client);
  runtime::Hanging half = own;
  half.segment = other.segment;
  expect_shown(client, refilled(model, next, half));
  Hang().send(client);
  expect_shown(client, refilled(model, next, own));
  EXPECT_FALSE(get_spheres(client).envelope.spheres().by_hand());
  // So is what equals it.
  Hang().segment(own.segment).joints(flat(own.joint)).send(client);
  EXPECT_FALSE(get_spheres(client).envelope.spheres().by_hand());
}

TEST(HungSpheres, WhatFitsNoBallOrJointIsRefused) {
  const TestServer server;
  TestClient client(server, "shared"), observer(server, "shared");
  const runtime::Hanging own = own_hanging(server.model());
  const auto segment_with = [&](std::int32_t row) {
    std::vector<std::int32_t> out = own.segment;
    out.back() = row;
    return out;
  };
  const auto joints_with = [&](double x) {
    std::vector<double> out = flat(own.joint);
    out[4] = x;
    return out;
  };
  const auto refused = [&](const Hang& hang, const std::string& why) {
    EXPECT_NE(refusal(client, hang).find(why), std::string::npos) << refusal(client, hang);
  };
  refused(Hang("pet"), "spheres: no volume 'pet' (ModelOpened.volumes has the names)");
  refused(Hang().segment({0}), "spheres: 'segment' is no i32 array of " + std::to_string(own.segment.size()) +
                                   " rows (one for each ball)");
  for (const std::int32_t row : {-1, 3, std::numeric_limits<std::int32_t>::max()})
    refused(Hang().segment(segment_with(row)), "spheres: a ball hangs on no segment of the 3");
  refused(Hang().joints({0, 0, 0}), "spheres: 'joints' is no f64 array of 3 for each of 3 segments");
  for (const double x :
       {1.1e6, -1.1e6, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    refused(Hang().joints(joints_with(x)), "spheres: a joint lies beyond 1e6 mm (mend its place)");
  Hang beyond = Hang().segment(own.segment);
  beyond.envelope.mutable_hang_spheres()->mutable_segment()->set_offset(1U << 30U);
  refused(beyond, "spheres: 'segment' is no i32 array");
  EXPECT_EQ(error_of_call(observer.client(), Hang().envelope), ErrorKind::refused) << "it does not control";
  v1::Envelope unknown;
  unknown.mutable_get_spheres()->set_volume("pet");
  EXPECT_EQ(error_of_call(observer.client(), unknown), ErrorKind::usage);
  EXPECT_FALSE(get_spheres(observer).envelope.spheres().by_hand()) << "nothing was hung";
}

TEST(HungSpheres, AModelWithoutBallsSaysSo) {
  Model model = test::toy_model();
  model.spheres.clear();
  const TestServer server({}, model);
  TestClient client(server);
  EXPECT_NE(refusal(client, Hang()).find("spheres: the model holds none (prepare it with --spheres)"),
            std::string::npos);
}

}  // namespace
}  // namespace ecorche::server
