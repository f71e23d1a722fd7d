// SPDX-License-Identifier: Apache-2.0
// Who does not read keeps nobody from a first frame.
#include "tests/unit/server/held_transport.hpp"
#include "tests/unit/server/session_stage.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

TEST(Room, IsLeftToThoseWhoNeedLittle) {
  constexpr std::uint64_t kMiB = 1 << 20;
  const MemoryBudget memory(512 * kMiB, 0);
  EXPECT_FALSE(memory.must_wait(1000 * kMiB, 0)) << "there is nothing else";
  const MemoryBudget::Reservation much(memory, 300 * kMiB);
  EXPECT_FALSE(memory.must_wait(84 * kMiB, 0));
  EXPECT_TRUE(memory.must_wait(85 * kMiB, 0)) << "a quarter is not for large ones";
  EXPECT_TRUE(memory.must_wait(84 * kMiB, 1));
  const MemoryBudget::Reservation more(memory, 140 * kMiB);
  EXPECT_FALSE(memory.must_wait(8 * kMiB, 0));
  EXPECT_TRUE(memory.must_wait(9 * kMiB, 0)) << "an eighth is for small ones";
  EXPECT_FALSE(memory.must_wait(kMiB / 4, 70 * kMiB));
  EXPECT_TRUE(memory.must_wait(kMiB / 4, 72 * kMiB));
}

// Nothing is made for who does not read, and the newest body once it does.
TEST(Room, FramesAreMadeForThoseWhoRead) {
  Stage stage;
  ASSERT_TRUE(stage.next_is_judged().has_value());
  stage.pose(1);
  ASSERT_TRUE(stage.next_is_judged().has_value());
  stage.watcher.read(false);
  const std::size_t before = stage.watcher.numbers().size();
  for (std::uint64_t pose = 2; pose <= 5; ++pose) {
    stage.pose(pose);
    stage.run_until([&] { return stage.session->poses().present().sequence == pose; });
  }
  Watcher newcomer;
  stage.session->join(newcomer);
  newcomer.read(false);
  stage.subscribe(newcomer, 30);
  stage.wait(kLong);
  EXPECT_EQ(stage.watcher.numbers().size(), before);
  EXPECT_TRUE(newcomer.numbers().empty());
  newcomer.read(true);
  stage.session->has_read();
  stage.run_until([&] { return !newcomer.numbers().empty(); });
  EXPECT_EQ(newcomer.frame().pose_sequence(), 5U);
  EXPECT_EQ(stage.watcher.numbers().size(), before);
  stage.watcher.read(true);
  stage.session->has_read();
  stage.run_until([&] { return stage.watcher.numbers().size() > before; });
  EXPECT_EQ(stage.watcher.frame().pose_sequence(), 5U);
  stage.session->leave(newcomer, false);
}

v1::Envelope numbered(std::uint64_t id) {
  v1::Envelope envelope;
  envelope.set_request_id(id);
  return envelope;
}

// Sleepers hold what memory there is, and would for as long as the server lets them: the one that holds most
// goes, and the newcomer has its first frame.
TEST(Room, WhoHoldsMostAndReadsNothingMakesWay) {
  std::uint64_t frame_bytes = 0;
  {
    const TestServer server;
    TestClient client(server);
    client.subscribe_mesh();
    frame_bytes = client.next_mesh(0).payload.size();
  }
  Options options;
  options.limits.queued_bytes = 4 * frame_bytes;
  options.limits.stall_seconds = 1000;
  options.limits.hello_seconds = 60;
  constexpr int kSleepers = 6;
  std::atomic<int> clients = 0;
  const TestServer server(
      options, {.transport = [&](std::unique_ptr<Transport> transport) -> std::unique_ptr<Transport> {
                  if (++clients > kSleepers) return transport;
                  return std::make_unique<HeldTransport>(std::move(transport));
                },
                .timer_fails = {},
                .handling = {}});
  std::vector<std::unique_ptr<RawClient>> sleepers;
  for (int i = 0; i < kSleepers; ++i) {
    sleepers.push_back(std::make_unique<RawClient>(server));
    RawClient& client = *sleepers.back();
    client.send_hello();
    ASSERT_TRUE(client.receive());
    v1::Envelope open = numbered(1), subscribe = numbered(2);
    open.mutable_open_model();
    client.send(open);
    ASSERT_TRUE(client.receive());
    subscribe.mutable_subscribe()->mutable_mesh();
    client.send(subscribe);
    ASSERT_TRUE(client.receive());
  }
  TestClient newcomer(server);
  newcomer.subscribe_mesh();
  newcomer.next_mesh(0);
  newcomer.send(1, newcomer.bent(0.1));
  newcomer.next_mesh(1);
}

}  // namespace
}  // namespace ecorche::server
