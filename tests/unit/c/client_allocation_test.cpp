// SPDX-License-Identifier: Apache-2.0
// Posing and polling allocate nothing in the client's process: counted over all of it, so the server is in
// another.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include <ecorche/ecorche_client.h>
#include "tests/support/counted_new.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::c {
namespace {

// A server of the toy body in a process of its own; it ends with this object.
class ServerProcess {
 public:
  ServerProcess() {
    std::array<int, 2> told{}, stop{};
    EXPECT_EQ(pipe(told.data()), 0);
    EXPECT_EQ(pipe(stop.data()), 0);
    child_ = fork();
    if (child_ == 0) {
      close(stop[1]);
      const server::TestServer server;
      const std::uint16_t port = server.address().port;
      char end = 0;
      if (write(told[1], &port, sizeof port) == sizeof port) static_cast<void>(read(stop[0], &end, 1));
      _exit(0);
    }
    close(stop[0]);
    stop_ = stop[1];
    EXPECT_EQ(read(told[0], &port_, sizeof port_), static_cast<ssize_t>(sizeof port_));
    close(told[0]);
    close(told[1]);
  }
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;
  ~ServerProcess() {
    close(stop_);
    waitpid(child_, nullptr, 0);
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  pid_t child_ = -1;
  int stop_ = -1;
  std::uint16_t port_ = 0;
};

// Bends the toy and waits for the frame of that pose, as a haptic loop would.
int bend(ecorche_client* client, double angle) {
  int failed = ecorche_client_set_angle(client, "middle_joint", "flexion", angle);
  std::uint64_t sequence = 0;
  failed += ecorche_client_send_pose(client, ECORCHE_SKINNING_COR, &sequence);
  for (int tries = 0; tries < 1000; ++tries) {
    ecorche_event event = ECORCHE_EVENT_INIT;
    failed += ecorche_client_poll(client, 10, &event);
    if (event.kind == ECORCHE_EVENT_NONE) return failed + 1;
    if (event.kind == ECORCHE_EVENT_FRAME && event.sequence == sequence) return failed;
  }
  return failed + 1;
}

TEST(ClientAllocation, AFrameAllocatesNothing) {
  const ServerProcess server;
  for (const ecorche_encoding encoding :
       {ECORCHE_ENCODING_F32, ECORCHE_ENCODING_U16, ECORCHE_ENCODING_U16_DELTA}) {
    ecorche_client* client = nullptr;
    ASSERT_EQ(ecorche_client_connect(server.address().c_str(), nullptr, &client), ECORCHE_OK)
        << ecorche_client_error_message();
    ASSERT_EQ(ecorche_client_open(client, "toy", nullptr), ECORCHE_OK);
    ecorche_stream_options options = ECORCHE_STREAM_OPTIONS_INIT;
    options.encoding = encoding;
    options.normals = 1;
    ASSERT_EQ(ecorche_client_subscribe(client, &options), ECORCHE_OK);
    int failed = 0;
    std::vector<float> positions(3 * 10'000), normals(3 * 10'000);
    const auto frame = [&](double angle) {
      failed += bend(client, angle);
      failed +=
          ecorche_client_copy(client, 0, ECORCHE_SPACE_UNITY, positions.data(), 0, normals.data(), 0, 10'000);
    };
    for (int i = 0; i < 10; ++i) frame(0.04 * i);
    const std::size_t before = test::allocated;
    for (int i = 0; i < 50; ++i) frame(0.01 * i);
    EXPECT_EQ(test::allocated - before, 0U) << "encoding " << encoding;
    EXPECT_EQ(failed, 0) << ecorche_client_error_message();
    ecorche_client_close(client);
  }
}

TEST(ClientAllocation, AVolumesFrameAllocatesNothing) {
  const ServerProcess server;
  ecorche_client* client = nullptr;
  ASSERT_EQ(ecorche_client_connect(server.address().c_str(), nullptr, &client), ECORCHE_OK);
  ASSERT_EQ(ecorche_client_open(client, "toy", nullptr), ECORCHE_OK);
  int failed = 0, shown = 0;
  for (const int compressed : {0, 1}) {
    ecorche_volume_options options = ECORCHE_VOLUME_OPTIONS_INIT;
    options.compressed = compressed;
    std::uint32_t stream = 0;
    ASSERT_EQ(ecorche_client_subscribe_volume(client, 0, &options, &stream), ECORCHE_OK);
    // As large in every pose.
    const auto frame = [&](double angle) {
      std::uint64_t sequence = 0;
      failed += ecorche_client_set_angle(client, "middle_joint", "flexion", angle);
      failed += ecorche_client_send_pose(client, ECORCHE_SKINNING_COR, &sequence);
      ecorche_event event = ECORCHE_EVENT_INIT;
      do failed += ecorche_client_poll(client, 10, &event);
      while (event.kind != ECORCHE_EVENT_NONE &&
             (event.kind != ECORCHE_EVENT_VOLUME || event.sequence < sequence));
      ecorche_voxels voxels = ECORCHE_VOXELS_INIT;
      failed += ecorche_client_voxels(client, stream, 0, &voxels);
      shown += voxels.sequence == sequence ? 1 : 0;
    };
    for (int i = 0; i < 10; ++i) frame(0.0001 * i);
    const std::size_t before = test::allocated;
    for (int i = 0; i < 50; ++i) frame(0.0001 * i);
    EXPECT_EQ(test::allocated - before, 0U) << compressed;
    failed += ecorche_client_unsubscribe_volume(client, stream);
  }
  EXPECT_EQ(shown, 120);
  EXPECT_EQ(failed, 0) << ecorche_client_error_message();
  ecorche_client_close(client);
}

TEST(ClientAllocation, TheCounterCounts) {
  const ServerProcess server;
  const std::size_t before = test::allocated;
  ecorche_client* client = nullptr;
  ASSERT_EQ(ecorche_client_connect(server.address().c_str(), nullptr, &client), ECORCHE_OK);
  EXPECT_GT(test::allocated, before) << "the library's operator new is this one";
  ecorche_client_close(client);
}

}  // namespace
}  // namespace ecorche::c
