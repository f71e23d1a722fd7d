// SPDX-License-Identifier: Apache-2.0
// What libecorche_client makes of a frame: numbers, floats and vertices of a space are of the same body.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <ecorche/ecorche_client.h>
#include "proto/oct16.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::c {
namespace {

struct Opened {
  ecorche_client* client = nullptr;
  std::uint32_t vertices = 0;

  Opened(const server::TestServer& server, ecorche_encoding encoding, bool normals) {
    const std::string address = "127.0.0.1:" + std::to_string(server.address().port);
    EXPECT_EQ(ecorche_client_connect(address.c_str(), nullptr, &client), ECORCHE_OK);
    EXPECT_EQ(ecorche_client_open(client, "toy", nullptr), ECORCHE_OK);
    ecorche_tissue_info info = ECORCHE_TISSUE_INFO_INIT;
    EXPECT_EQ(ecorche_client_tissue(client, 0, &info), ECORCHE_OK);
    vertices = info.vertex_count;
    ecorche_stream_options options = ECORCHE_STREAM_OPTIONS_INIT;
    options.encoding = encoding;
    options.normals = normals ? 1 : 0;
    EXPECT_EQ(ecorche_client_subscribe(client, &options), ECORCHE_OK);
    // Two poses: the second comes as deltas.
    for (const double angle : {0.2, 0.7}) bend(angle);
  }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  ~Opened() { ecorche_client_close(client); }

  void bend(double angle) const {
    ecorche_client_set_angle(client, "middle_joint", "flexion", angle);
    std::uint64_t sequence = 0;
    ASSERT_EQ(ecorche_client_send_pose(client, ECORCHE_SKINNING_COR, &sequence), ECORCHE_OK);
    ecorche_event event = ECORCHE_EVENT_INIT;
    do ASSERT_EQ(ecorche_client_poll(client, 10, &event), ECORCHE_OK);
    while (event.kind != ECORCHE_EVENT_NONE &&
           (event.kind != ECORCHE_EVENT_FRAME || event.sequence != sequence));
    ASSERT_EQ(event.kind, ECORCHE_EVENT_FRAME);
  }
};

TEST(ClientFrame, FloatsAreThoseOfTheNumbers) {
  const server::TestServer server;
  for (const ecorche_encoding encoding : {ECORCHE_ENCODING_U16, ECORCHE_ENCODING_U16_DELTA}) {
    const Opened toy(server, encoding, true);
    ecorche_packed packed = ECORCHE_PACKED_INIT;
    ASSERT_EQ(ecorche_client_packed(toy.client, 0, &packed), ECORCHE_OK) << ecorche_client_error_message();
    ASSERT_EQ(packed.vertex_count, toy.vertices);
    const float* const positions = ecorche_client_positions(toy.client, 0);
    const float* const normals = ecorche_client_normals(toy.client, 0);
    for (std::size_t v = 0; v < toy.vertices; ++v) {
      const auto unit = wire::from_oct16(packed.normals[2 * v], packed.normals[2 * v + 1]);
      for (std::size_t c = 0; c < 3; ++c) {
        ASSERT_EQ(positions[3 * v + c],
                  static_cast<float>(packed.low[c] + packed.step * packed.positions[3 * v + c]));
        ASSERT_EQ(normals[3 * v + c], unit[c]) << v;
      }
    }
    // The floats of the next frame are made anew.
    const std::vector<float> before(positions, positions + std::size_t{3} * toy.vertices);
    toy.bend(0.1);
    const float* const after = ecorche_client_positions(toy.client, 0);
    EXPECT_NE(before, std::vector<float>(after, after + std::size_t{3} * toy.vertices));
  }
}

TEST(ClientFrame, AVertexOfEightBytesHoldsTheNumbers) {
  const server::TestServer server;
  for (const bool with_normals : {true, false}) {
    const Opened toy(server, ECORCHE_ENCODING_U16_DELTA, with_normals);
    ecorche_packed packed = ECORCHE_PACKED_INIT;
    ASSERT_EQ(ecorche_client_packed(toy.client, 0, &packed), ECORCHE_OK);
    EXPECT_EQ(packed.normals != nullptr, with_normals);
    std::vector<std::array<std::uint16_t, 4>> vertices(toy.vertices + 1, {7, 7, 7, 7});
    ASSERT_EQ(ecorche_client_copy_packed(toy.client, 0, vertices.data(), toy.vertices), ECORCHE_OK);
    for (std::size_t v = 0; v < toy.vertices; ++v) {
      for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(vertices[v][c], packed.positions[3 * v + c]) << v;
      const int normal =
          with_normals ? packed.normals[2 * v] + 128 + 256 * (packed.normals[2 * v + 1] + 128) : 0;
      ASSERT_EQ(vertices[v][3], normal) << v;
    }
    EXPECT_EQ(vertices.back(), (std::array<std::uint16_t, 4>{7, 7, 7, 7}));
    EXPECT_EQ(ecorche_client_copy_packed(toy.client, 0, vertices.data(), toy.vertices - 1),
              ECORCHE_INVALID_ARGUMENT);
    EXPECT_EQ(ecorche_client_copy_packed(toy.client, 0, nullptr, toy.vertices), ECORCHE_INVALID_ARGUMENT);
    EXPECT_EQ(ecorche_client_packed(toy.client, 1000, &packed), ECORCHE_FAILED_PRECONDITION);
  }
}

TEST(ClientFrame, ACopyIsThePositionsInTheSpace) {
  struct Case {
    ecorche_space space;
    std::array<int, 3> axes;  // 1: x, -2: y turned
    float scale;
  };
  const std::array<Case, 3> spaces{{{ECORCHE_SPACE_LPS_MM, {1, 2, 3}, 1.0F},
                                    {ECORCHE_SPACE_UNITY, {-1, 3, -2}, 1e-3F},
                                    {ECORCHE_SPACE_UNREAL, {-2, -1, 3}, 0.1F}}};
  const server::TestServer server;
  for (const ecorche_encoding encoding : {ECORCHE_ENCODING_F32, ECORCHE_ENCODING_U16_DELTA}) {
    const Opened toy(server, encoding, true);
    const float* const positions = ecorche_client_positions(toy.client, 0);
    const float* const normals = ecorche_client_normals(toy.client, 0);
    for (const auto& [space, axes, scale] : spaces) {
      // A vertex of the caller's: position, normal, and what is not the library's.
      std::vector<std::array<float, 7>> vertices(toy.vertices, {0, 0, 0, 0, 0, 0, 9});
      ASSERT_EQ(ecorche_client_copy(toy.client, 0, space, vertices[0].data(), 28, &vertices[0][3], 28,
                                    toy.vertices),
                ECORCHE_OK);
      for (std::size_t v = 0; v < toy.vertices; ++v) {
        ASSERT_EQ(vertices[v][6], 9);
        for (std::size_t r = 0; r < 3; ++r) {
          const std::size_t from = 3 * v + static_cast<std::size_t>(std::abs(axes[r]) - 1);
          const float sign = axes[r] < 0 ? -1 : 1;
          ASSERT_EQ(vertices[v][r], sign * scale * positions[from]) << v;
          ASSERT_EQ(vertices[v][3 + r], sign * normals[from]) << v;
        }
      }
    }
  }
}

TEST(ClientFrame, FloatsHaveNoNumbers) {
  const server::TestServer server;
  const Opened toy(server, ECORCHE_ENCODING_F32, false);
  ecorche_packed packed = ECORCHE_PACKED_INIT;
  EXPECT_EQ(ecorche_client_packed(toy.client, 0, &packed), ECORCHE_FAILED_PRECONDITION);
  EXPECT_STREQ(ecorche_client_error_message(),
               "encoding: frames of ECORCHE_ENCODING_F32 have no numbers (see ecorche_stream_options)");
  std::vector<std::uint16_t> vertices(std::size_t{4} * toy.vertices);
  EXPECT_EQ(ecorche_client_copy_packed(toy.client, 0, vertices.data(), toy.vertices),
            ECORCHE_FAILED_PRECONDITION);
  EXPECT_EQ(ecorche_client_normals(toy.client, 0), nullptr);
}

}  // namespace
}  // namespace ecorche::c
