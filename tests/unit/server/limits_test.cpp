// SPDX-License-Identifier: Apache-2.0
// Every limit, and that nobody else notices when one strikes.
#include "proto/arrays.hpp"
#include "tests/unit/server/held_transport.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

TEST(LimitsTest, AHelloTooLateEndsTheConnection) {
  Limits limits;
  limits.hello_seconds = 0.05;
  const TestServer server(limits);
  RawClient client(server);
  EXPECT_EQ(client.last_words(), StatusCode::deadline_exceeded);
}

// Each at its own time, not at the next of the server's rounds, which are a tenth of a second apart.
TEST(LimitsTest, DeadlinesAreMetWhenTheyAreDue) {
  Limits limits;
  limits.hello_seconds = 0.3;
  constexpr int kClients = 8, kMost = 6;
  int prompt = 0;
  for (int tries = 0; tries < 5 && prompt < kMost; ++tries) {  // on a busy machine all may be late
    const TestServer server(limits);
    std::vector<std::pair<std::unique_ptr<RawClient>, client::Clock::time_point>> silent;
    for (int i = 0; i < kClients; ++i) {
      silent.emplace_back(std::make_unique<RawClient>(server), client::Clock::now());
      std::this_thread::sleep_for(std::chrono::milliseconds(12));
    }
    prompt = 0;
    for (const auto& [client, born] : silent) {
      EXPECT_EQ(client->last_words(), StatusCode::deadline_exceeded);
      const auto lived = client::Clock::now() - born;
      EXPECT_GE(lived, std::chrono::milliseconds(295));
      prompt += lived < std::chrono::milliseconds(325) ? 1 : 0;
    }
  }
  EXPECT_GE(prompt, kMost);
}

TEST(LimitsTest, AHelloTooLargeEndsTheConnection) {
  const TestServer server;
  RawClient client(server);
  v1::Envelope hello;
  hello.mutable_client_hello()->set_token(std::string(5000, 'x'));
  client.send(hello);
  EXPECT_EQ(client.last_words(), StatusCode::resource_exhausted);
}

TEST(LimitsTest, LaterEnvelopesMayBeLargerButNotTooLarge) {
  const TestServer server;
  RawClient client(server);
  client.send_hello();
  ASSERT_TRUE(client.receive());
  v1::Envelope large;
  large.mutable_ping()->set_data(std::string(60000, 'x'));
  client.send(large);
  const auto refused = client.receive();  // too much for a ping, and for nothing else
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::invalid_argument));
  large.mutable_ping()->set_data(std::string(70000, 'x'));
  client.send(large);
  EXPECT_EQ(client.last_words(), StatusCode::resource_exhausted);
}

TEST(LimitsTest, APayloadTooLargeEndsTheConnectionBeforeItIsSent) {
  const TestServer server;
  RawClient client(server);
  client.send_hello();
  ASSERT_TRUE(client.receive());
  client.send(std::string("\x04\x00\x00\x00\x00\x00\x00\x40", 8));  // a gigabyte is announced
  EXPECT_EQ(client.last_words(), StatusCode::resource_exhausted);
}

TEST(LimitsTest, OneConnectionTooManyIsToldSo) {
  Limits limits;
  limits.connections = 2;
  const TestServer server(limits);
  TestClient a(server);
  auto b = std::make_unique<TestClient>(server);
  RawClient third(server);
  EXPECT_EQ(third.last_words(), StatusCode::resource_exhausted);
  a.subscribe_mesh();
  a.next_mesh(0);
  // Room again once one has left.
  b.reset();
  bool welcome = false;
  for (int i = 0; i < 200 && !welcome; ++i) {
    RawClient again(server);
    again.send_hello();
    const auto answer = again.receive();
    welcome = answer && answer->envelope.has_server_hello();
  }
  EXPECT_TRUE(welcome);
}

TEST(LimitsTest, SubscriptionsPerConnection) {
  Limits limits;
  limits.subscriptions = 2;
  const TestServer server(limits);
  TestClient client(server);
  client.subscribe_mesh();
  client.subscribe_volume(client.opened().volumes(0).name());
  v1::Envelope third;
  third.mutable_subscribe()->mutable_mesh()->add_tissues(client.opened().tissues(0).name());
  EXPECT_EQ(error_of_call(client.client(), third), ErrorKind::temporary);
}

TEST(LimitsTest, PosesAreTakenUpNoFasterThanTheRate) {
  Limits limits;
  limits.poses_per_second = 20;
  const TestServer server(limits);
  TestClient client(server);
  const auto start = client::Clock::now();
  // The first is taken up at once; each of the next four waits its 50 ms.
  for (std::uint64_t sequence = 1; sequence <= 5; ++sequence) {
    client.send(sequence, client.bent(0.1));
    EXPECT_EQ(client.next_ack().sequence(), sequence);
  }
  EXPECT_GE(client::Clock::now() - start, std::chrono::milliseconds(4 * 50 - 1));
}

TEST(LimitsTest, MessagesBeyondTheRateWaitAndAreAllAnswered) {
  Limits limits;
  limits.messages_per_second = 50;
  const TestServer server(limits);
  client::Client client(server.address(), "test");
  v1::Envelope ping;
  ping.mutable_ping();
  const auto start = client::Clock::now();
  // A second's worth may come at once.
  for (int i = 0; i < 70; ++i) EXPECT_TRUE(client.call(ping).envelope.has_pong());
  EXPECT_GE(client::Clock::now() - start, std::chrono::milliseconds(300));
}

TEST(LimitsTest, HalfAMessageIsNotWaitedForForever) {
  Limits limits;
  limits.stall_seconds = 0.1;
  const TestServer server(limits);
  RawClient client(server);
  client.send_hello();
  ASSERT_TRUE(client.receive());
  client.send(std::string("\x09\x00\x00", 3));
  EXPECT_EQ(client.last_words(), StatusCode::deadline_exceeded);
}

TEST(LimitsTest, SilenceAfterAWholeMessageIsNoHalfOne) {
  Limits limits;
  limits.stall_seconds = 0.1;
  const TestServer server(limits);
  client::Client client(server.address(), "test");
  v1::Envelope ping;
  ping.mutable_ping();
  EXPECT_TRUE(client.call(ping).envelope.has_pong());
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  EXPECT_TRUE(client.call(ping).envelope.has_pong());
}

TEST(LimitsTest, WhoSaysNothingIsDroppedInTheEnd) {
  Limits limits;
  limits.idle_seconds = 0.2;
  const TestServer server(limits);
  RawClient client(server);
  client.send_hello();
  ASSERT_TRUE(client.receive());
  EXPECT_EQ(client.last_words(), StatusCode::deadline_exceeded);
}

// Opens and subscribes without ever acknowledging a frame.
void subscribe_and_sleep(RawClient& client, const std::string& session) {
  client.send_hello();
  ASSERT_TRUE(client.receive());
  v1::Envelope open;
  open.set_request_id(1);
  open.mutable_open_model()->set_session(session);
  client.send(open);
  ASSERT_TRUE(client.receive());
  v1::Envelope subscribe;
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->mutable_mesh();
  client.send(subscribe);
}

TEST(LimitsTest, AStalledClientIsDroppedAndNobodyElseNotices) {
  Limits limits;
  limits.stall_seconds = 0.3;
  const TestServer server(limits);
  TestClient creator(server, "shared");
  creator.subscribe_mesh();
  RawClient sleeper(server);
  subscribe_and_sleep(sleeper, "shared");
  bool gone = false;
  std::uint64_t sequence = 0;
  while (!gone && sequence < 500) {
    ++sequence;
    creator.send(sequence, creator.bent(0.001 * static_cast<double>(sequence)));
    creator.next_mesh(sequence);  // every pose, at once
    if (sequence > 100) gone = sleeper.hung_up(0.001);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_TRUE(gone);
}

TEST(LimitsTest, NoMoreFramesAreSentThanAreAcknowledged) {
  Limits limits;
  limits.frames_in_flight = 2;
  const TestServer server(limits);
  TestClient creator(server, "shared");
  RawClient sleeper(server);
  subscribe_and_sleep(sleeper, "shared");
  for (std::uint64_t sequence = 1; sequence <= 20; ++sequence) {
    creator.send(sequence, creator.bent(0.01 * static_cast<double>(sequence)));
    EXPECT_EQ(creator.next_ack().sequence(), sequence);
  }
  std::vector<v1::MeshFrame> frames;
  const auto drain = [&] {
    while (const auto frame = sleeper.receive(0.3)) {
      if (frame->envelope.has_mesh_frame()) frames.push_back(frame->envelope.mesh_frame());
    }
  };
  drain();
  ASSERT_EQ(frames.size(), 2U);
  v1::Envelope ack;
  ack.mutable_frame_ack()->set_subscription(frames[1].subscription());
  ack.mutable_frame_ack()->set_frame(frames[1].frame());
  sleeper.send(ack);
  drain();
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[2].pose_sequence(), 20U);  // the newest replaced all that waited
}

TEST(LimitsTest, WhereFramesFillTheMemoryNewOnesWaitAndPatienceIsShort) {
  Options options;
  options.limits.queued_bytes = 0;
  options.limits.stall_seconds = 4;
  int clients = 0;
  const TestServer server(
      options, {.transport = [&](std::unique_ptr<Transport> transport) -> std::unique_ptr<Transport> {
                  if (++clients != 2) return transport;
                  return std::make_unique<HeldTransport>(std::move(transport));
                },
                .timer_fails = {},
                .handling = {}});
  TestClient streams(server);
  streams.subscribe_mesh();
  streams.next_mesh(0);
  RawClient sleeper(server);
  subscribe_and_sleep(sleeper, "");
  const auto start = client::Clock::now();
  TestClient late(server);
  late.subscribe_mesh();
  // Who had frames gets more of them, who had none waits until the sleeper has been dropped.
  std::uint64_t sequence = 0;
  for (bool first = false; !first;) {
    ++sequence;
    streams.send(sequence, streams.bent(0.001 * static_cast<double>(sequence)));
    streams.next_mesh(sequence);
    const auto until = client::Clock::now() + std::chrono::milliseconds(20);
    while (const auto frame = late.client().receive(until)) first = first || frame->envelope.has_mesh_frame();
  }
  const double waited = std::chrono::duration<double>(client::Clock::now() - start).count();
  EXPECT_GT(waited, 0.5);
  EXPECT_LT(waited, 3.5);  // a quarter of the usual, not all of it
  EXPECT_GT(sequence, 10U);
}

// An answer that its client does not read, such as a probe's; not the triangles of a model, which all share.
TEST(LimitsTest, AnswersThatWaitAreFramesLike) {
  for (const bool own : {true, false}) {
    SCOPED_TRACE(own ? "a probe's" : "a model's");
    std::atomic<bool> holds = false;
    int clients = 0;
    Options options;
    options.limits.queued_bytes = 0;
    options.limits.stall_seconds = 1000;
    const TestServer server(
        options, {.transport = [&](std::unique_ptr<Transport> transport) -> std::unique_ptr<Transport> {
                    if (++clients != 1) return transport;
                    return std::make_unique<HeldTransport>(std::move(transport), own ? 2 : 1, &holds);
                  },
                  .timer_fails = {},
                  .handling = {}});
    auto sleeper = std::make_unique<RawClient>(server);
    sleeper->send_hello();
    v1::Envelope open, probe;
    open.set_request_id(1);
    open.mutable_open_model();
    sleeper->send(open);
    probe.set_request_id(2);
    probe.mutable_probe_points()->set_direction(v1::ProbePoints::DIRECTION_REST_TO_POSED);
    auto payload = std::make_shared<wire::Payload>();
    const std::vector<double> point{0, 0, 10};
    *probe.mutable_probe_points()->mutable_points() =
        wire::append(*payload, std::span<const double>(point), 3);
    if (own) {
      ASSERT_TRUE(sleeper->receive() && sleeper->receive());
      sleeper->send(probe, payload);
    }
    while (!holds) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    TestClient other(server);
    other.subscribe_mesh();
    const auto sees = [&](double seconds) {
      const auto until = client::Clock::now() + duration(seconds);
      while (const auto frame = other.client().receive(until)) {
        if (frame->envelope.has_mesh_frame()) return true;
      }
      return false;
    };
    EXPECT_EQ(sees(own ? 0.5 : 20), !own);
    if (!own) continue;
    sleeper = nullptr;
    EXPECT_TRUE(sees(20)) << "nothing waits any more";
  }
}

TEST(LimitsTest, WhereFramesFillHalfOfTheMemoryPatienceIsShort) {
  std::uint64_t frame_bytes = 0;
  {
    const TestServer server;
    TestClient client(server);
    client.subscribe_mesh();
    frame_bytes = client.next_mesh(0).payload.size();
  }
  // Half of the memory holds less than a frame, more than one, and, for two clients, less than both.
  struct Case {
    std::uint64_t halves;
    int clients;
    bool soon;
  };
  for (const auto& [halves, clients, soon] : {Case{3, 1, true}, {6, 1, false}, {6, 2, true}}) {
    SCOPED_TRACE(std::to_string(halves) + " halves, clients: " + std::to_string(clients));
    Options options;
    options.limits.queued_bytes = halves * frame_bytes / 2;
    options.limits.stall_seconds = 1.6;
    const TestServer server(
        options, {.transport = [](std::unique_ptr<Transport> transport) -> std::unique_ptr<Transport> {
                    return std::make_unique<HeldTransport>(std::move(transport));
                  },
                  .timer_fails = {},
                  .handling = {}});
    std::vector<std::unique_ptr<RawClient>> sleepers;
    for (int i = 0; i < clients; ++i) {
      sleepers.push_back(std::make_unique<RawClient>(server));
      subscribe_and_sleep(*sleepers.back(), "");
    }
    const auto start = client::Clock::now();
    for (const auto& sleeper : sleepers) EXPECT_TRUE(sleeper->hung_up());
    const double waited = std::chrono::duration<double>(client::Clock::now() - start).count();
    EXPECT_EQ(waited < 1.5, soon) << waited << " s of 1.6";
  }
}

}  // namespace
}  // namespace ecorche::server
