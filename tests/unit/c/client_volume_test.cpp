// SPDX-License-Identifier: Apache-2.0
// Posed volumes by libecorche_client, beside offline posing: byte for byte.
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/ecorche_client.h>
#include <ecorche/kinematics/named_angles.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "runtime/spheres/pose_volume.hpp"
#include "runtime/spheres/slice.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/c/client_caller.hpp"

namespace ecorche::c {
namespace {

// Row of the CT, and of the labels.
constexpr std::uint32_t kCt = 0, kLabels = 1;

std::string told() {
  return ecorche_client_error_message();
}

// The hinge bent, as the caller bends it.
runtime::PosedBody posed(const Model& model, double flexion) {
  const runtime::BodyPoser poser(std::make_shared<const Model>(model));
  runtime::PosedBody out = poser.make_frame();
  const auto angle = kinematics::find_named_angle(model.rig.skeleton, "middle_joint", "flexion");
  EXPECT_TRUE(
      poser.run(kinematics::pose_of(model.rig.skeleton, {{*angle, flexion}}), runtime::Skinning::cor, {}, out)
          .ok());
  return out;
}

Image by_tets(const Model& model, std::uint32_t volume, const runtime::PosedBody& body,
              const ImageGrid& grid) {
  const ModelVolume& of = model.volumes[volume];
  const auto sampling = of.labels ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
  return runtime::pose_volume(std::make_shared<const Model>(model), body.nodes, of, sampling, grid);
}

void expect_shows(const ecorche_voxels& shown, const Image& expected) {
  EXPECT_EQ(std::vector<std::int32_t>(shown.grid.size, shown.grid.size + 3),
            std::vector<std::int32_t>(expected.grid.size.begin(), expected.grid.size.end()));
  EXPECT_TRUE(std::equal(shown.grid.origin, shown.grid.origin + 3, expected.grid.origin.begin()));
  EXPECT_TRUE(std::equal(shown.grid.spacing, shown.grid.spacing + 3, expected.grid.spacing.begin()));
  EXPECT_EQ(shown.type, static_cast<ecorche_scalar>(expected.type));
  EXPECT_EQ(shown.components, expected.components);
  ASSERT_EQ(shown.bytes, expected.bytes.size());
  EXPECT_EQ(std::memcmp(shown.voxels, expected.bytes.data(), shown.bytes), 0);
}

TEST(ClientVolume, TellsWhatTheModelHas) {
  const server::TestServer server;
  const Caller caller(server);
  const std::vector<ModelVolume>& volumes = server.model().volumes;
  ASSERT_EQ(ecorche_client_volume_count(caller.client), volumes.size());
  for (std::uint32_t v = 0; v < volumes.size(); ++v) {
    ecorche_volume_info info = ECORCHE_VOLUME_INFO_INIT;
    ASSERT_EQ(ecorche_client_volume(caller.client, v, &info), ECORCHE_OK);
    EXPECT_EQ(info.name, volumes[v].name);
    EXPECT_EQ(info.type, static_cast<ecorche_scalar>(volumes[v].image.type));
    EXPECT_EQ(info.labels != 0, volumes[v].labels);
    EXPECT_EQ(info.background, volumes[v].background);
    EXPECT_EQ(info.grid.size[2], volumes[v].image.grid.size[2]);
    EXPECT_EQ(info.rest, nullptr);
  }
}

TEST(ClientVolume, EveryWayEqualsOfflinePosing) {
  const Model model = test::fine_toy_model(8);
  const server::TestServer server({}, model);
  const std::array<double, 6> box{-31, -18, 120, 14, 60, 260};
  const runtime::Region region{{box[0], box[1], box[2]}, {box[3], box[4], box[5]}};
  for (const bool spheres : {false, true}) {
    for (const bool part : {false, true}) {
      for (const bool compressed : {false, true}) {
        SCOPED_TRACE(std::to_string(spheres) + std::to_string(part) + std::to_string(compressed));
        const Caller caller(server);
        ecorche_volume_options options = ECORCHE_VOLUME_OPTIONS_INIT;
        options.deformer = spheres ? ECORCHE_DEFORMER_SPHERES : ECORCHE_DEFORMER_TETS;
        options.region = part ? box.data() : nullptr;
        options.compressed = compressed ? 1 : 0;
        std::uint32_t stream = 0;
        ASSERT_EQ(ecorche_client_subscribe_volume(caller.client, kCt, &options, &stream), ECORCHE_OK)
            << told();
        // The keyframe, and what is against it: the tip alone moves.
        for (const double angle : {0.002, 0.004, 0.5}) {
          const std::uint64_t sequence = caller.bend(angle);
          ASSERT_TRUE(caller.voxels_of(sequence, stream));
          ecorche_voxels shown = ECORCHE_VOXELS_INIT;
          ASSERT_EQ(ecorche_client_voxels(caller.client, stream, 0, &shown), ECORCHE_OK) << told();
          EXPECT_EQ(shown.sequence, sequence);
          const runtime::PosedBody body = posed(model, angle);
          const ModelVolume& ct = model.volumes[kCt];
          if (spheres) {
            expect_shows(shown, runtime::pose_volume(model, body.segments, ct,
                                                     part ? std::optional(region) : std::nullopt,
                                                     runtime::Sampling::trilinear));
            continue;
          }
          ImageGrid grid = runtime::grow_to(ct.image.grid, body.nodes);
          if (part) {
            const runtime::LatticeBox within = runtime::box_within(ct.image.grid, region.low, region.high);
            grid = runtime::grid_of(ct.image.grid, within);
          }
          expect_shows(shown, by_tets(model, kCt, body, grid));
        }
      }
    }
  }
}

// Two planes of different sizes, one of them oblique, by both deformers.
TEST(ClientVolume, SlicesLieWhereTheyWereAskedFor) {
  const server::TestServer server;
  const Model& model = server.model();
  std::array<ecorche_grid, 2> planes{};
  planes[0] = {{7, 5, 1}, {-20, -10, 150}, {5, 4, 1}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  planes[1] = {{6, 20, 1}, {-15, 3, 30}, {6, 12, 1}, {0.8, 0, 0.6, 0.6, 0, -0.8, 0, 1, 0}};
  for (const bool spheres : {false, true}) {
    const Caller caller(server);
    ecorche_volume_options options = ECORCHE_VOLUME_OPTIONS_INIT;
    options.slices = planes.data();
    options.slice_count = planes.size();
    options.deformer = spheres ? ECORCHE_DEFORMER_SPHERES : ECORCHE_DEFORMER_TETS;
    std::uint32_t stream = 0;
    ASSERT_EQ(ecorche_client_subscribe_volume(caller.client, kCt, &options, &stream), ECORCHE_OK) << told();
    ASSERT_TRUE(caller.voxels_of(caller.bend(0.4), stream));
    const runtime::PosedBody body = posed(model, 0.4);
    const ModelVolume& ct = model.volumes[kCt];
    for (std::uint32_t s = 0; s < planes.size(); ++s) {
      ecorche_voxels shown = ECORCHE_VOXELS_INIT;
      ASSERT_EQ(ecorche_client_voxels(caller.client, stream, s, &shown), ECORCHE_OK) << told();
      ImageGrid grid;
      std::copy_n(planes[s].size, 3, grid.size.begin());
      std::copy_n(planes[s].origin, 3, grid.origin.begin());
      std::copy_n(planes[s].spacing, 3, grid.spacing.begin());
      std::copy_n(planes[s].direction, 9, grid.direction.begin());
      Image expected(grid, ct.image.type);
      if (spheres) {
        runtime::refill_slice(runtime::VolumeBalls(model, ct).at(body.segments), ct.image, ct.background,
                              runtime::Sampling::trilinear, expected);
      } else {
        expected = by_tets(model, kCt, body, grid);
      }
      expect_shows(shown, expected);
    }
    ecorche_voxels none = ECORCHE_VOXELS_INIT;
    EXPECT_EQ(ecorche_client_voxels(caller.client, stream, 2, &none), ECORCHE_INVALID_ARGUMENT);
    EXPECT_EQ(told(), "slice: the stream has not so many (0 without slices)");
  }
}

class ComesBack : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(ToItsPlace, ComesBack, testing::Values(true));
INSTANTIATE_TEST_SUITE_P(AsAnybody, ComesBack, testing::Values(false));

// Where the server keeps places, and where it keeps none: another client keeps the session.
TEST_P(ComesBack, WithItsStreams) {
  server::Limits limits;
  if (!GetParam()) limits.linger_seconds = 0;
  const server::TestServer server(limits);
  const Caller caller(server);
  const Caller other(server, ecorche_client_session(caller.client));
  std::uint32_t ct = 0, labels = 0, again = 0;
  ASSERT_EQ(ecorche_client_subscribe_volume(caller.client, kCt, nullptr, &ct), ECORCHE_OK) << told();
  ASSERT_EQ(ecorche_client_subscribe_volume(caller.client, kLabels, nullptr, &labels), ECORCHE_OK) << told();
  EXPECT_NE(ct, labels);
  ASSERT_EQ(ecorche_client_subscribe_volume(caller.client, kCt, nullptr, &again), ECORCHE_OK) << told();
  EXPECT_EQ(again, ct) << "the same is one stream";
  for (int round = 0; round < 3; ++round) {
    std::uint64_t sequence = caller.bend(0.1 * round + 0.1);
    ASSERT_TRUE(caller.voxels_of(sequence, labels)) << round;
    ecorche_voxels shown = ECORCHE_VOXELS_INIT;
    ASSERT_EQ(ecorche_client_voxels(caller.client, labels, 0, &shown), ECORCHE_OK) << told();
    const runtime::PosedBody body = posed(server.model(), 0.1 * round + 0.1);
    const ImageGrid& rest = server.model().volumes[kLabels].image.grid;
    expect_shows(shown, by_tets(server.model(), kLabels, body, runtime::grow_to(rest, body.nodes)));
    ASSERT_EQ(ecorche_client_resume(caller.client), ECORCHE_OK) << told();
  }
  ASSERT_EQ(ecorche_client_unsubscribe_volume(caller.client, labels), ECORCHE_OK) << told();
  EXPECT_EQ(ecorche_client_unsubscribe_volume(caller.client, labels), ECORCHE_NOT_FOUND);
  EXPECT_EQ(told(),
            "stream " + std::to_string(labels) + ": there is none (see ecorche_client_subscribe_volume)");
  ecorche_voxels none = ECORCHE_VOXELS_INIT;
  EXPECT_EQ(ecorche_client_voxels(caller.client, labels, 0, &none), ECORCHE_NOT_FOUND);
  EXPECT_TRUE(caller.voxels_of(caller.bend(0.5), ct)) << "the other goes on";
}

TEST(ClientVolume, WhatIsWrongIsRefusedInWords) {
  const server::TestServer server;
  const Caller caller(server);
  std::uint32_t stream = 7;
  const auto refused = [&](const ecorche_volume_options& options) {
    EXPECT_EQ(ecorche_client_subscribe_volume(caller.client, kCt, &options, &stream),
              ECORCHE_INVALID_ARGUMENT);
    return told();
  };
  EXPECT_EQ(ecorche_client_subscribe_volume(caller.client, 9, nullptr, &stream), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(told(), "volume 9: the model has 2 of them");
  ecorche_volume_info info = ECORCHE_VOLUME_INFO_INIT;
  EXPECT_EQ(ecorche_client_volume(caller.client, 2, &info), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(ecorche_client_subscribe_volume(caller.client, kCt, nullptr, nullptr), ECORCHE_INVALID_ARGUMENT);
  EXPECT_EQ(told(), "stream: is null");
  ecorche_volume_options options = ECORCHE_VOLUME_OPTIONS_INIT;
  options.deformer = static_cast<ecorche_deformer>(3);
  EXPECT_EQ(refused(options), "deformer: there is no such deformer (see ecorche_deformer)");
  options = ECORCHE_VOLUME_OPTIONS_INIT;
  options.slice_count = 1;
  EXPECT_EQ(refused(options), "slices: are none, or more than 16 (NULL and 0 for the volume)");
  const ecorche_grid thick{{7, 5, 2}, {0, 0, 150}, {5, 4, 1}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  options.slices = &thick;
  EXPECT_EQ(refused(options), "slices: one is not one voxel thick along k (set size[2] to 1)");
  options = ECORCHE_VOLUME_OPTIONS_INIT;
  const std::array<double, 6> nowhere{0, 0, 0, -1, -1, -1};
  options.region = nowhere.data();
  EXPECT_NE(refused(options).find("region"), std::string::npos) << told();
  options = ECORCHE_VOLUME_OPTIONS_INIT;
  options.max_rate = -1;
  EXPECT_NE(refused(options).find("max_rate"), std::string::npos) << told();
  EXPECT_EQ(stream, 7U) << "stays";
  ASSERT_EQ(ecorche_client_subscribe_volume(caller.client, kCt, nullptr, &stream), ECORCHE_OK) << told();
  ecorche_voxels none = ECORCHE_VOXELS_INIT;
  EXPECT_EQ(ecorche_client_voxels(caller.client, stream, 0, &none), ECORCHE_FAILED_PRECONDITION);
  EXPECT_EQ(told(), "stream: no frame of it has come (poll on)");
  Model bare = test::toy_model();
  bare.spheres.clear();
  const server::TestServer without({}, bare);
  const Caller other(without);
  options = ECORCHE_VOLUME_OPTIONS_INIT;
  options.deformer = ECORCHE_DEFORMER_SPHERES;
  EXPECT_EQ(ecorche_client_subscribe_volume(other.client, kCt, &options, &stream),
            ECORCHE_FAILED_PRECONDITION);
  EXPECT_NE(told().find("spheres"), std::string::npos) << told();
}

// A server's limit on voxels is told by the frame, and the stream goes on.
TEST(ClientVolume, WhyThereAreNoVoxelsIsTold) {
  server::Limits limits;
  limits.volume_voxels = 500;
  const server::TestServer server(limits);
  const Caller caller(server);
  std::uint32_t stream = 0;
  const ecorche_code code = ecorche_client_subscribe_volume(caller.client, kCt, nullptr, &stream);
  if (code != ECORCHE_OK) {
    EXPECT_EQ(code, ECORCHE_RESOURCE_EXHAUSTED) << told();
    return;
  }
  ecorche_event event = ECORCHE_EVENT_INIT;
  do {
    ASSERT_EQ(ecorche_client_poll(caller.client, 60, &event), ECORCHE_OK) << told();
    ASSERT_NE(event.kind, ECORCHE_EVENT_NONE);
  } while (event.kind != ECORCHE_EVENT_VOLUME);
  EXPECT_EQ(event.stream, stream);
  EXPECT_EQ(event.code, ECORCHE_RESOURCE_EXHAUSTED);
  EXPECT_NE(told().find("voxels"), std::string::npos) << told();
  ecorche_voxels none = ECORCHE_VOXELS_INIT;
  EXPECT_EQ(ecorche_client_voxels(caller.client, stream, 0, &none), ECORCHE_FAILED_PRECONDITION);
}

}  // namespace
}  // namespace ecorche::c
