// SPDX-License-Identifier: Apache-2.0
// Volumes by the spheres deformer, over a real socket, beside offline refilling: byte for byte.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <set>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/wire/convert.hpp>
#include <ecorche/wire/volume_decoder.hpp>
#include "proto/arrays.hpp"
#include "runtime/server/session/subscription.hpp"
#include "runtime/spheres/pose_volume.hpp"
#include "runtime/spheres/slice.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

v1::Envelope request_for(const std::string& volume) {
  v1::Envelope envelope;
  v1::VolumeSelection& selection = *envelope.mutable_subscribe()->mutable_volume();
  selection.set_volume(volume);
  selection.set_deformer(v1::DEFORMER_SPHERES);
  return envelope;
}

void set_region(v1::Envelope& envelope, const runtime::Region& region) {
  v1::Box& box = *envelope.mutable_subscribe()->mutable_volume()->mutable_region();
  const auto set = [](v1::Vector3& out, const runtime::Vec3& v) {
    out.set_x(v[0]);
    out.set_y(v[1]);
    out.set_z(v[2]);
  };
  set(*box.mutable_min(), region.low);
  set(*box.mutable_max(), region.high);
}

TEST(SpheresStream, VolumesAndRegionsEqualOfflineRefilling) {
  const TestServer server;
  const Model& model = server.model();
  const runtime::Region region{{-31, -18, 120}, {14, 60, 260}};
  std::uint64_t sequence = 0;
  TestClient client(server);
  for (const ModelVolume& volume : model.volumes) {
    for (const bool whole : {true, false}) {
      v1::Envelope request = request_for(volume.name);
      if (!whole) set_region(request, region);
      const std::uint32_t subscription = client.client().call(request).envelope.subscribed().subscription();
      const Pose pose = client.bent(0.5);
      client.send(++sequence, pose);
      const wire::Frame frame = client.next([&](const v1::Envelope& e) {
        return e.volume_frame().subscription() == subscription &&
               e.volume_frame().pose_sequence() == sequence;
      });
      const v1::VolumeFrame& sent = frame.envelope.volume_frame();
      ASSERT_EQ(sent.status().code(), 0U) << sent.status().message();
      const runtime::BodyPoser poser(std::make_shared<const Model>(model));
      runtime::PosedBody body = poser.make_frame();
      ASSERT_TRUE(poser.run(pose, runtime::Skinning::cor, {}, body).ok());
      const auto part = whole ? std::nullopt : std::optional(region);
      const Image expected =
          runtime::pose_volume(model, body.segments, volume, part, runtime::Sampling::trilinear);
      ImageGrid grid;
      ASSERT_TRUE(wire::from_proto(sent.grid(), grid).ok());
      EXPECT_EQ(grid, expected.grid);
      std::span<const std::byte> voxels;
      ASSERT_TRUE(wire::find(sent.voxels(), frame.payload, voxels));
      ASSERT_EQ(voxels.size(), expected.bytes.size());
      EXPECT_EQ(std::memcmp(voxels.data(), expected.bytes.data(), voxels.size()), 0);
      // Something lies there, and it moved.
      const Image rest = runtime::pose_volume(model, std::vector<RigidTransform>(body.segments.size()),
                                              volume, part, runtime::Sampling::trilinear);
      EXPECT_NE(rest.bytes, expected.bytes);
    }
  }
}

// Keyframes, bricks and zstd; and planes, which no pose of the whole volume is made for.
TEST(SpheresStream, BricksAndSlicesEqualOfflineRefilling) {
  const Model model = test::fine_toy_model(5);
  const TestServer server({}, model);
  TestClient client(server);
  v1::Envelope bricks = request_for("ct"), slices = request_for("ct");
  bricks.mutable_subscribe()->mutable_volume()->set_changed_bricks(true);
  bricks.mutable_subscribe()->mutable_volume()->set_compressed(true);
  std::vector<ImageGrid> planes;
  for (const double y : {-4.0, 7.5}) {
    v1::Slice& slice = *slices.mutable_subscribe()->mutable_volume()->add_slices();
    slice.mutable_origin()->set_x(-20);
    slice.mutable_origin()->set_y(y);
    slice.mutable_u()->set_x(1.25);
    slice.mutable_v()->set_z(3);
    slice.set_size_u(40);
    slice.set_size_v(90);
    ImageGrid plane;
    plane.size = {40, 90, 1};
    plane.origin = {-20, y, 0};
    plane.spacing = {1.25, 3, 1};
    plane.direction = {1, 0, 0, 0, 0, -1, 0, 1, 0};
    planes.push_back(plane);
  }
  const std::uint32_t volume = client.client().call(bricks).envelope.subscribed().subscription(),
                      cut = client.client().call(slices).envelope.subscribed().subscription();
  const runtime::BodyPoser poser(std::make_shared<const Model>(model));
  runtime::PosedBody body = poser.make_frame();
  const runtime::VolumeBalls balls(model, model.volumes[0]);
  wire::VolumeDecoder decoder;
  Image image;
  std::size_t partial = 0;
  const wire::Frame first =
      client.next([&](const v1::Envelope& e) { return e.volume_frame().subscription() == volume; });
  ASSERT_TRUE(decoder.decode(first.envelope.volume_frame(), first.payload, image).ok());
  for (std::uint64_t sequence = 1; sequence < 5; ++sequence) {
    Pose pose = client.bent(0.3);
    // Then the tip alone turns, about the beam.
    pose.rotation[2] = Eigen::AngleAxisd(0.02 * static_cast<double>(sequence), Eigen::Vector3d::UnitZ());
    client.send(sequence, pose);
    ASSERT_TRUE(poser.run(pose, runtime::Skinning::cor, {}, body).ok());
    for (std::set<std::uint32_t> left{volume, cut}; !left.empty();) {  // whichever comes first
      const wire::Frame frame = client.next([&](const v1::Envelope& e) {
        return left.contains(e.volume_frame().subscription()) && e.volume_frame().pose_sequence() == sequence;
      });
      const v1::VolumeFrame& sent = frame.envelope.volume_frame();
      const std::uint32_t subscription = sent.subscription();
      left.erase(subscription);
      ASSERT_EQ(sent.status().code(), 0U) << sent.status().message();
      std::vector<std::byte> expected;
      if (subscription == volume) {
        ASSERT_TRUE(decoder.decode(sent, frame.payload, image).ok());
        partial += sent.has_bricks() ? 1 : 0;
        expected = runtime::pose_volume(model, body.segments, model.volumes[0], std::nullopt,
                                        runtime::Sampling::trilinear)
                       .bytes;
      } else {
        wire::VolumeDecoder plain;
        ASSERT_TRUE(plain.decode(sent, frame.payload, image).ok());
        for (const ImageGrid& plane : planes) {
          Image pixels(plane, ScalarType::i16, 1);
          runtime::refill_slice(balls.at(body.segments), model.volumes[0].image, model.volumes[0].background,
                                runtime::Sampling::trilinear, pixels);
          expected.insert(expected.end(), pixels.bytes.begin(), pixels.bytes.end());
        }
      }
      EXPECT_EQ(image.bytes, expected) << (subscription == volume ? "bricks" : "slices") << sequence;
    }
  }
  EXPECT_GT(partial, 0U);
}

TEST(SpheresStream, TetsStayWhatIsMeantWithoutAWord) {
  const Model model = test::toy_model();
  v1::Subscribe request;
  request.mutable_volume()->set_volume("ct");
  StreamSpec spec;
  ASSERT_TRUE(read_spec(request, model, spec).ok());
  EXPECT_FALSE(std::get<VolumeSpec>(spec).by_spheres);
  request.mutable_volume()->set_deformer(v1::DEFORMER_TETS);
  ASSERT_TRUE(read_spec(request, model, spec).ok());
  EXPECT_FALSE(std::get<VolumeSpec>(spec).by_spheres);
}

TEST(SpheresStream, WhatCannotBeRefilledIsRefused) {
  const TestServer server;
  StreamSpec spec;
  const auto code = [&](const v1::Envelope& request, const Model& model) {
    return read_spec(request.subscribe(), model, spec).code;
  };
  v1::Envelope request = request_for("ct");
  EXPECT_EQ(code(request, server.model()), StatusCode::ok);
  Model without = server.model();
  without.spheres.clear();
  EXPECT_EQ(code(request, without), StatusCode::failed_precondition);
  request.mutable_subscribe()->mutable_volume()->set_deformer(static_cast<v1::Deformer>(7));
  EXPECT_EQ(code(request, server.model()), StatusCode::unimplemented);
  for (const runtime::Region& region : {runtime::Region{{0, 0, 10}, {0, 0, 5}},
                                        {{0, 0, 0}, {1, 1, std::nan("")}},
                                        {{-24, -24, -4}, {-21, -21, -1}}}) {
    request = request_for("ct");
    set_region(request, region);
    EXPECT_EQ(code(request, server.model()), StatusCode::invalid_argument);
  }
}

}  // namespace
}  // namespace ecorche::server
