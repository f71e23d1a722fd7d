// SPDX-License-Identifier: Apache-2.0
// libecorche_client in the hands of who does not do as its examples do.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <ecorche/ecorche_client.h>
#include "tests/unit/server/test_server.hpp"

namespace ecorche::c {
namespace {

/// Has the toy open.
struct Caller {
  ecorche_client* client = nullptr;

  explicit Caller(const server::TestServer& server, const char* session = nullptr) {
    const std::string address = "127.0.0.1:" + std::to_string(server.address().port);
    EXPECT_EQ(ecorche_client_connect(address.c_str(), nullptr, &client), ECORCHE_OK);
    EXPECT_EQ(ecorche_client_open(client, "toy", session), ECORCHE_OK) << ecorche_client_error_message();
  }
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;
  ~Caller() { ecorche_client_close(client); }

  std::uint64_t bend(double angle) const {
    std::uint64_t sequence = 0;
    EXPECT_EQ(ecorche_client_set_angle(client, "middle_joint", "flexion", angle), ECORCHE_OK);
    EXPECT_EQ(ecorche_client_send_pose(client, ECORCHE_SKINNING_COR, &sequence), ECORCHE_OK);
    return sequence;
  }
  /// Reads until the frame of the pose, and counts those before it.
  int frames_until(std::uint64_t sequence) const {
    ecorche_event event = ECORCHE_EVENT_INIT;
    for (int frames = 0;;) {
      EXPECT_EQ(ecorche_client_poll(client, 10, &event), ECORCHE_OK) << ecorche_client_error_message();
      if (event.kind == ECORCHE_EVENT_NONE) return -1;
      if (event.kind != ECORCHE_EVENT_FRAME) continue;
      if (event.sequence >= sequence) return frames;
      ++frames;
    }
  }
  ecorche_code probe() const {
    const std::array<float, 3> point{};
    std::array<float, 3> there{};
    ecorche_probed probed = ECORCHE_PROBED_INIT;
    probed.points = there.data();
    return ecorche_client_posed_to_rest(client, point.data(), 1, &probed);
  }
};

TEST(ClientStream, FramesDoNotPileUpForWhoOnlyAsks) {
  const server::TestServer server;
  for (const ecorche_encoding encoding :
       {ECORCHE_ENCODING_F32, ECORCHE_ENCODING_U16, ECORCHE_ENCODING_U16_DELTA}) {
    const Caller poser(server);
    const Caller asker(server, ecorche_client_session(poser.client));
    ecorche_stream_options options = ECORCHE_STREAM_OPTIONS_INIT;
    options.encoding = encoding;
    ASSERT_EQ(ecorche_client_subscribe(poser.client, &options), ECORCHE_OK);
    ASSERT_EQ(ecorche_client_subscribe(asker.client, &options), ECORCHE_OK);
    std::uint64_t last = 0;
    for (int i = 1; i <= 40; ++i) {
      last = poser.bend(0.02 * i);
      ASSERT_GE(poser.frames_until(last), 0);
      for (int j = 0; j < 3; ++j) ASSERT_EQ(asker.probe(), ECORCHE_OK) << ecorche_client_error_message();
    }
    // The newest, one on its way, and a keyframe that they are against.
    EXPECT_LE(asker.frames_until(last), 3) << encoding;
    ecorche_tissue_info info = ECORCHE_TISSUE_INFO_INIT;
    ASSERT_EQ(ecorche_client_tissue(asker.client, 0, &info), ECORCHE_OK);
    const float* const theirs = ecorche_client_positions(asker.client, 0);
    const float* const mine = ecorche_client_positions(poser.client, 0);
    ASSERT_NE(theirs, nullptr);
    const std::size_t numbers = std::size_t{3} * info.vertex_count;
    EXPECT_EQ(std::vector<float>(theirs, theirs + numbers), std::vector<float>(mine, mine + numbers));
  }
}

}  // namespace
}  // namespace ecorche::c
