// SPDX-License-Identifier: Apache-2.0
// A caller of libecorche_client with the toy body open.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>

#include <ecorche/ecorche_client.h>
#include "tests/unit/server/test_server.hpp"

namespace ecorche::c {

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
  /// Reads until the stream shows the pose.
  bool voxels_of(std::uint64_t sequence, std::uint32_t stream) const {
    ecorche_event event = ECORCHE_EVENT_INIT;
    for (;;) {
      EXPECT_EQ(ecorche_client_poll(client, 60, &event), ECORCHE_OK) << ecorche_client_error_message();
      if (event.kind == ECORCHE_EVENT_NONE) return false;
      if (event.kind != ECORCHE_EVENT_VOLUME || event.stream != stream) continue;
      EXPECT_EQ(event.code, ECORCHE_OK) << ecorche_client_error_message();
      if (event.sequence >= sequence) return true;
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

}  // namespace ecorche::c
