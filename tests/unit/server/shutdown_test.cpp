// SPDX-License-Identifier: Apache-2.0
// Starting and ending.
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/forwarding_transport.hpp"
#include "tests/unit/server/test_server.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

TEST(Shutdown, EveryClientGetsAGoodbye) {
  TestServer server;
  TestClient busy(server);
  busy.subscribe_mesh();
  RawClient silent(server);
  RawClient idle(server);
  idle.send_hello();
  ASSERT_TRUE(idle.receive());  // connections are accepted in order: the silent one is known too
  for (std::uint64_t sequence = 1; sequence <= 20; ++sequence) busy.send(sequence, busy.bent(0.01));
  server.stop();
  EXPECT_EQ(idle.last_words(), StatusCode::unavailable);
  EXPECT_EQ(silent.last_words(), StatusCode::unavailable);
  try {
    busy.next([](const v1::Envelope&) { return false; });
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::temporary);
  }
  server.join();
}

TEST(Shutdown, ClientsThatDoNotReadDoNotHoldItUp) {
  TestServer server;
  RawClient deaf(server);
  deaf.send_hello();
  const auto start = client::Clock::now();
  server.stop();
  server.join();
  EXPECT_LT(client::Clock::now() - start, std::chrono::seconds(10));
}

// Who asks /readyz hears first that it stops; clients go on meanwhile, and newcomers come in.
TEST(Shutdown, BeforeThatClientsAreDrained) {
  Options options;
  options.http = Endpoint{};
  options.drain_seconds = 1;
  options.elsewhere = "192.0.2.1:7070";
  TestServer server(options);
  TestClient poser(server);
  poser.subscribe_mesh();
  EXPECT_EQ(WebClient(server.http()).get("/readyz").rfind("HTTP/1.1 200", 0), 0U);
  const auto begun = client::Clock::now();
  server.stop();
  while (WebClient(server.http()).get("/readyz").rfind("HTTP/1.1 503", 0) != 0)
    ASSERT_LT(client::Clock::now() - begun, std::chrono::seconds(1));
  poser.send(1, poser.bent(0.2));
  poser.next_mesh(1);
  RawClient newcomer(server);
  newcomer.send_hello();
  ASSERT_TRUE(newcomer.receive()->envelope.has_server_hello());
  const auto last = newcomer.receive();
  ASSERT_TRUE(last);
  EXPECT_GE(client::Clock::now() - begun, std::chrono::milliseconds(950));
  EXPECT_EQ(last->envelope.goodbye().status().code(), static_cast<std::uint32_t>(StatusCode::unavailable));
  EXPECT_EQ(last->envelope.goodbye().elsewhere(), "192.0.2.1:7070");
  EXPECT_LT(last->envelope.goodbye().retry_seconds(), 0.5);
  EXPECT_EQ(poser.client().elsewhere(), "");
  EXPECT_THROW(poser.next([](const v1::Envelope&) { return false; }), client::ServerError);
  EXPECT_EQ(poser.client().elsewhere(), "192.0.2.1:7070");
  server.join();
}

TEST(Shutdown, BeforeItRanAndTwice) {
  Workers workers(1, [](const Job& job) { job(); });
  Options options;
  options.listen.port = 0;
  Server server(options, {{"toy", std::make_shared<const Model>(test::toy_model())}}, workers);
  EXPECT_NE(server.port(), 0);
  server.stop();
  server.stop();
  server.run();
}

TEST(Start, WhatCannotBeServedIsRefused) {
  const auto model = std::make_shared<const Model>(test::toy_model());
  const auto kind_of = [&](Options options, std::vector<NamedModel> models) {
    Workers workers(1, [](const Job& job) { job(); });
    try {
      const Server server(std::move(options), std::move(models), workers);
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::internal;
  };
  Options options;
  options.listen.port = 0;
  EXPECT_EQ(kind_of(options, {}), ErrorKind::config);
  EXPECT_EQ(kind_of(options, {{"a", model}, {"a", model}}), ErrorKind::config);
  EXPECT_EQ(kind_of(options, {9, NamedModel{"a", model}}), ErrorKind::config);
  options.listen.host = "0.0.0.0";
  EXPECT_EQ(kind_of(options, {{"a", model}}), ErrorKind::refused);
  options.listen.host = "nowhere";
  EXPECT_EQ(kind_of(options, {{"a", model}}), ErrorKind::usage);

  const TestServer running;
  Options same;
  same.listen.port = running.address().port;
  EXPECT_EQ(kind_of(same, {{"a", model}}), ErrorKind::temporary);
}

// A connection whose frames leave when they may.
class SlowTransport final : public ForwardingTransport {
 public:
  SlowTransport(std::unique_ptr<Transport> inner, std::atomic<bool>& held)
      : ForwardingTransport(std::move(inner)), held_(held), pause_(executor()) {}

  net::awaitable<void> write(std::span<const net::const_buffer> frames,
                             boost::system::error_code& ec) override {
    while (held_) {
      pause_.expires_after(std::chrono::milliseconds(2));
      co_await pause_.async_wait(quietly(ec));
    }
    co_await ForwardingTransport::write(frames, ec);
  }

 private:
  std::atomic<bool>& held_;
  net::steady_timer pause_;
};

// Neither a frame that waited, nor an answer that took long.
TEST(Shutdown, NothingComesAfterTheLastWords) {
  for (const bool stops : {true, false}) {
    std::atomic<bool> held = false, reads = false, ends = false;
    TestServer server(Options{}, {.transport =
                                      [&](std::unique_ptr<Transport> transport) {
                                        return std::make_unique<SlowTransport>(std::move(transport), held);
                                      },
                                  .timer_fails = {},
                                  .handling = {}});
    server.reads([&]() -> ModelParts {
      reads = true;
      while (!ends) std::this_thread::sleep_for(std::chrono::milliseconds(2));
      throw Error(ErrorKind::data, "toy.hdf", "is cut", "copy it again");
    });
    RawClient client(server);
    const auto ask = [&](v1::Envelope envelope, std::uint64_t id) {
      envelope.set_request_id(id);
      client.send(envelope);
    };
    client.send_hello();
    v1::Envelope open, subscribe, pose, reload;
    open.mutable_open_model();
    ask(open, 2);
    subscribe.mutable_subscribe()->mutable_mesh();
    ask(subscribe, 3);
    std::uint64_t digest = 0;
    while (const auto frame = client.receive()) {
      if (frame->envelope.has_model_opened()) digest = frame->envelope.model_opened().rig_digest();
      if (frame->envelope.has_mesh_frame()) break;  // never acknowledged: one more may be on its way
    }
    held = true;
    reload.mutable_reload_model()->set_model("toy");
    ask(reload, 4);
    for (std::uint64_t sequence = 1; sequence <= 2; ++sequence) {
      v1::PoseUpdate& update = *pose.mutable_pose_update();
      update.Clear();
      update.set_sequence(sequence);
      update.set_rig_digest(digest);
      for (std::size_t i = 0; i < 4 * server.model().segment_count(); ++i)
        update.add_rotation(i % 4 == 0 ? 1 : 0);
      client.send(pose);
      // The first one's frame is being written, the second one's waits.
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    while (!reads) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (stops)
      server.stop();
    else
      client.send_hello();  // a second one
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ends = true;
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    held = false;
    bool ended = false;
    while (const auto frame = client.receive()) {
      EXPECT_FALSE(ended) << frame->envelope.message_case();
      ended = ended || frame->envelope.has_goodbye() ||
              (frame->envelope.has_status() && frame->envelope.request_id() == 0);
    }
    EXPECT_TRUE(ended);
  }
}

}  // namespace
}  // namespace ecorche::server
