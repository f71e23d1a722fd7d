// SPDX-License-Identifier: Apache-2.0
// Slices, changed bricks and compressed voxels against offline posing.
#include <memory>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/wire/volume_decoder.hpp>
#include "proto/arrays.hpp"
#include "runtime/server/session/volume_stream.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

struct OfflineVolumes {
  explicit OfflineVolumes(const Pose& pose) : OfflineVolumes(pose, test::toy_model()) {}
  OfflineVolumes(const Pose& pose, const Model& of)
      : model(std::make_shared<const Model>(of)), poser(model), body(poser.make_frame()) {
    EXPECT_TRUE(poser.run(pose, runtime::Skinning::cor, poser.all_tissues(), body).ok());
  }
  Image volume(std::size_t row) const {
    const ModelVolume& rest = model->volumes[row];
    const auto sampling = rest.labels ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
    return runtime::pose_volume(model, body.nodes, rest, sampling,
                                runtime::grow_to(rest.image.grid, body.nodes));
  }
  std::shared_ptr<const Model> model;
  runtime::BodyPoser poser;
  runtime::PosedBody body;
};

wire::Frame next_volume(TestClient& client, std::uint64_t sequence) {
  return client.next([=](const v1::Envelope& e) {
    return e.has_volume_frame() && e.volume_frame().pose_sequence() == sequence;
  });
}

TEST(Volumes, EveryWayOfSendingThemGivesOfflinePosing) {
  const Model model = test::fine_toy_model(8);
  for (const bool compressed : {false, true}) {
    for (const bool bricks : {false, true}) {
      SCOPED_TRACE(std::string(compressed ? "compressed" : "plain") + (bricks ? " bricks" : ""));
      const TestServer server({}, model);
      TestClient client(server);
      v1::Envelope request;
      v1::VolumeSelection& volume = *request.mutable_subscribe()->mutable_volume();
      volume.set_volume(model.volumes[0].name);
      volume.set_compressed(compressed);
      volume.set_changed_bricks(bricks);
      client.client().call(request);
      wire::VolumeDecoder decoder;
      Image image;
      std::size_t partial = 0, bytes = 0;
      const wire::Frame rest = next_volume(client, 0);
      ASSERT_TRUE(decoder.decode(rest.envelope.volume_frame(), rest.payload, image).ok());
      for (std::uint64_t sequence = 1; sequence < 6; ++sequence) {
        // The tip alone moves, a little: most bricks keep still.
        const Pose pose = client.bent(0.002 * static_cast<double>(sequence));
        client.send(sequence, pose);
        const wire::Frame frame = next_volume(client, sequence);
        const v1::VolumeFrame& got = frame.envelope.volume_frame();
        ASSERT_EQ(got.status().code(), 0U) << got.status().message();
        EXPECT_EQ(got.has_content(), compressed);
        EXPECT_EQ(got.keyframe() != 0, bricks);
        if (got.has_bricks()) ++partial;
        bytes += frame.payload.size();
        const Status status = decoder.decode(got, frame.payload, image);
        ASSERT_TRUE(status.ok()) << status.message;
        const Image expected = OfflineVolumes(pose, model).volume(0);
        EXPECT_EQ(image.grid, expected.grid);
        EXPECT_EQ(image.bytes, expected.bytes);
      }
      EXPECT_EQ(partial > 0, bricks);
      if (compressed || bricks) {
        EXPECT_LT(bytes, 5 * image.bytes.size());
      }
    }
  }
}

// A body that is carried away makes the lattice grow, for every stream: as far as there is memory.
TEST(Volumes, ALatticeGrowsOnlyAsFarAsTheMemoryGoes) {
  const auto model = std::make_shared<const Model>(test::toy_model());
  const ServedModel served("toy", model);
  const std::uint64_t scan = model->volumes[0].image.bytes.size();
  const MemoryBudget memory(0, 9 * scan);  // three copies are kept
  const runtime::BodyPoser poser(model);
  const auto body_at = [&](double mm) {
    Pose pose = Pose::rest(model->segment_count());
    pose.root_translation.z() = mm;
    runtime::PosedBody body = poser.make_frame();
    EXPECT_TRUE(poser.run(pose, runtime::Skinning::cor, {}, body).ok());
    return body;
  };
  VolumeSpec spec;
  spec.changed_bricks = true;
  const std::uint64_t voxels = model->volumes[0].image.grid.voxels();
  VolumeStream first(spec, voxels, memory.kept_pool()), second(spec, voxels, memory.kept_pool());
  const HungSpheres hung{};
  std::uint64_t number = 0;
  const auto write = [&](VolumeStream& stream, double mm, v1::VolumeFrame& frame) {
    frame.Clear();
    frame.set_frame(++number);
    wire::Payload payload;
    const runtime::PosedBody body = body_at(mm);
    return stream.write({served, hung, body}, 1U << 28, false, frame, payload);
  };
  v1::VolumeFrame frame;
  EXPECT_TRUE(write(first, 0, frame).ok());
  EXPECT_TRUE(write(second, 0, frame).ok());
  EXPECT_TRUE(write(first, 600, frame).ok());  // about twice the scan more
  EXPECT_EQ(write(first, 2000, frame).code, StatusCode::resource_exhausted);
  EXPECT_EQ(write(second, 600, frame).code, StatusCode::resource_exhausted);
  // At home there is always room, and all of it comes.
  EXPECT_TRUE(write(second, 0, frame).ok());
  EXPECT_EQ(frame.keyframe(), frame.frame());
  EXPECT_TRUE(write(first, 0, frame).ok());
  EXPECT_TRUE(write(second, 600, frame).ok());
  EXPECT_EQ(memory.bytes(), 0U) << "frames are not counted here";
}

TEST(Volumes, SlicesArePlanesOfThePosedVolume) {
  const TestServer server;
  TestClient client(server);
  v1::Envelope request;
  v1::VolumeSelection& volume = *request.mutable_subscribe()->mutable_volume();
  volume.set_volume(server.model().volumes[0].name);
  const ImageGrid rest = server.model().volumes[0].image.grid;
  std::vector<ImageGrid> planes;
  for (int s = 0; s < 2; ++s) {
    v1::Slice& slice = *volume.add_slices();
    slice.mutable_origin()->set_x(rest.origin[0]);
    slice.mutable_origin()->set_y(rest.origin[1] + 10 * s);
    slice.mutable_origin()->set_z(rest.origin[2]);
    slice.mutable_u()->set_x(2.5);
    slice.mutable_v()->set_z(3);
    slice.set_size_u(20);
    slice.set_size_v(50 + static_cast<std::uint32_t>(s));
    ImageGrid plane;
    plane.size = {20, 50 + s, 1};
    plane.origin = {rest.origin[0], rest.origin[1] + 10 * s, rest.origin[2]};
    plane.spacing = {2.5, 3, 1};
    plane.direction = {1, 0, 0, 0, 0, -1, 0, 1, 0};
    planes.push_back(plane);
  }
  client.client().call(request);
  const Pose pose = client.bent(0.4);
  client.send(1, pose);
  const wire::Frame frame = next_volume(client, 1);
  wire::VolumeDecoder decoder;
  Image image;
  ASSERT_TRUE(decoder.decode(frame.envelope.volume_frame(), frame.payload, image).ok());
  EXPECT_FALSE(frame.envelope.volume_frame().has_grid());
  const OfflineVolumes offline(pose);
  std::vector<std::byte> expected;
  for (const ImageGrid& plane : planes) {
    const Image posed = runtime::pose_volume(offline.model, offline.body.nodes, offline.model->volumes[0],
                                             runtime::Sampling::trilinear, plane);
    expected.insert(expected.end(), posed.bytes.begin(), posed.bytes.end());
  }
  EXPECT_EQ(image.bytes, expected);
}

TEST(Volumes, ARegionIsThatPartOfThePosedVolume) {
  const Model model = test::fine_toy_model(8);
  const TestServer server({}, model);
  TestClient client(server);
  v1::Envelope request;
  v1::VolumeSelection& volume = *request.mutable_subscribe()->mutable_volume();
  volume.set_volume(model.volumes[0].name);
  volume.set_changed_bricks(true);
  v1::Box& box = *volume.mutable_region();
  box.mutable_min()->set_x(-60);
  box.mutable_min()->set_y(-9);
  box.mutable_min()->set_z(90);
  box.mutable_max()->set_x(20);
  box.mutable_max()->set_y(14);
  box.mutable_max()->set_z(230);
  client.client().call(request);
  const ImageGrid& rest = model.volumes[0].image.grid;
  const ImageGrid grid = grid_of(rest, runtime::box_within(rest, {-60, -9, 90}, {20, 14, 230}));
  wire::VolumeDecoder decoder;
  Image image;
  for (std::uint64_t sequence = 0; sequence < 4; ++sequence) {
    const Pose pose = client.bent(0.1 * static_cast<double>(sequence));
    if (sequence > 0) client.send(sequence, pose);
    const wire::Frame frame = next_volume(client, sequence);
    ASSERT_TRUE(decoder.decode(frame.envelope.volume_frame(), frame.payload, image).ok());
    const OfflineVolumes offline(pose, model);
    const Image expected = runtime::pose_volume(offline.model, offline.body.nodes, offline.model->volumes[0],
                                                runtime::Sampling::trilinear, grid);
    EXPECT_EQ(image.grid, grid);
    EXPECT_EQ(image.bytes, expected.bytes);
  }
}

// A hand-made frame of 40 x 1 x 1 voxels, two bricks, spoilt in every way.
TEST(Volumes, WhatIsNoFrameIsRefused) {
  v1::VolumeFrame key;
  wire::Payload payload;
  v1::Grid& grid = *key.mutable_grid();
  grid.set_size_i(40);
  grid.set_size_j(1);
  grid.set_size_k(1);
  for (v1::Vector3* v : {grid.mutable_spacing()}) {
    v->set_x(1);
    v->set_y(1);
    v->set_z(1);
  }
  for (int i = 0; i < 9; ++i) grid.add_direction(i % 4 == 0 ? 1 : 0);
  key.set_frame(3);
  key.set_keyframe(3);
  const std::vector<std::uint8_t> voxels(40, 7);
  *key.mutable_voxels() = wire::append(payload, std::span<const std::uint8_t>(voxels), 1);
  const auto bricks = [&](const std::vector<std::uint32_t>& rows, std::size_t count, wire::Payload& out) {
    v1::VolumeFrame frame = key;
    frame.set_frame(4);
    *frame.mutable_bricks() = wire::append(out, std::span<const std::uint32_t>(rows), 1);
    const std::vector<std::uint8_t> changed(count, 9);
    *frame.mutable_voxels() = wire::append(out, std::span<const std::uint8_t>(changed), 1);
    return frame;
  };
  wire::VolumeDecoder decoder;
  Image image;
  const auto refused = [&](const v1::VolumeFrame& frame, const wire::Payload& bytes, const char* what) {
    const Status status = decoder.decode(frame, bytes, image);
    EXPECT_FALSE(status.ok()) << what;
    EXPECT_NE(status.message.find(what), std::string::npos) << status.message;
  };
  wire::Payload part;
  const v1::VolumeFrame good = bricks({1}, 8, part);
  refused(good, part, "its keyframe 3 did not come");
  ASSERT_TRUE(decoder.decode(key, payload, image).ok());
  ASSERT_TRUE(decoder.decode(good, part, image).ok());
  EXPECT_EQ(image.bytes[31], std::byte{7});
  EXPECT_EQ(image.bytes[32], std::byte{9});
  const auto spoilt = [&](const std::vector<std::uint32_t>& rows, std::size_t count, const char* what) {
    wire::Payload bytes;
    const v1::VolumeFrame frame = bricks(rows, count, bytes);
    refused(frame, bytes, what);
  };
  spoilt({2}, 8, "its bricks are not those of the grid");
  spoilt({1, 1}, 16, "its bricks are not those of the grid");
  spoilt({1}, 7, "its bricks are cut short");
  spoilt({1}, 9, "goes on behind its last brick");
  v1::VolumeFrame other = good;
  other.mutable_grid()->set_size_i(41);
  refused(other, part, "its grid is not the keyframe's");
  other = key;
  other.mutable_grid()->set_size_i(41);
  refused(other, payload, "its voxels are not those of its grid");
  other = key;
  other.mutable_voxels()->set_type(v1::SCALAR_TYPE_UNSPECIFIED);
  refused(other, payload, "its voxels are of no type");
  other = key;
  other.mutable_voxels()->set_count(400);
  refused(other, payload, "reach beyond the payload");
  other = key;
  *other.mutable_content() = key.voxels();
  refused(other, payload, "no zstd frame of the size it says");
  other.mutable_content()->set_count(std::uint64_t{1} << 60);
  refused(other, payload, "it says that it holds too much");
}

}  // namespace
}  // namespace ecorche::server
