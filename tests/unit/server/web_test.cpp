// SPDX-License-Identifier: Apache-2.0
// The HTTP port and WebSockets, over real sockets.
#include "tests/unit/server/web_client.hpp"

#include <cstring>

#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

// One that the server has greeted.
struct Greeted : WebClient {
  explicit Greeted(const TestServer& server) : WebClient(server.http()) {
    upgrade();
    send_frame(greeting());
    EXPECT_TRUE(frame());
  }
};

TEST(Web, HealthAndReadinessAreTold) {
  const TestServer server(with_http());
  EXPECT_TRUE(starts(WebClient(server.http()).get("/healthz"), "HTTP/1.1 200"));
  EXPECT_TRUE(starts(WebClient(server.http()).get("/readyz"), "HTTP/1.1 200"));
  EXPECT_TRUE(starts(WebClient(server.http()).get("/"), "HTTP/1.1 404"));
  WebClient post(server.http());
  post.send("POST /healthz HTTP/1.1\r\nHost: test\r\nContent-Length: 0\r\n\r\n");
  EXPECT_TRUE(starts(post.rest(), "HTTP/1.1 405"));
  WebClient head(server.http());
  head.send("HEAD /healthz HTTP/1.1\r\nHost: test\r\n\r\n");
  EXPECT_TRUE(head.rest().ends_with("\r\n\r\n"));
}

TEST(Web, AServerThatStopsIsAliveButNotReady) {
  TestServer server(with_http());
  RawClient deaf(server);  // holds the server up for its last second
  deaf.send_hello();
  ASSERT_TRUE(deaf.receive());
  server.stop();
  std::string answer;
  for (int i = 0; i < 50 && !starts(answer, "HTTP/1.1 503"); ++i)
    answer = WebClient(server.http()).get("/readyz");
  EXPECT_TRUE(starts(answer, "HTTP/1.1 503")) << answer;
}

// The value of a sample of the page.
double sample(const std::string& page, const std::string& name) {
  const auto at = page.find("\n" + name + " ");
  return at == std::string::npos ? -1 : std::stod(page.substr(at + name.size() + 2));
}

TEST(Web, MetricsCountWhatHappened) {
  Options options = with_http();
  options.limits.subscriptions = 1;
  const TestServer server(options);
  TestClient client(server);
  client.subscribe_mesh();
  client.next_mesh(0);
  for (std::uint64_t sequence = 1; sequence <= 5; ++sequence) {
    client.send(sequence, client.bent(0.1));
    client.next_mesh(sequence);
  }
  v1::Envelope second;
  second.mutable_subscribe()->mutable_mesh()->set_quality(true);
  EXPECT_EQ(error_of_call(client.client(), second), ErrorKind::temporary);
  const std::string page = WebClient(server.http()).get("/metrics");
  EXPECT_EQ(sample(page, "ecorche_clients"), 1);
  EXPECT_EQ(sample(page, "ecorche_sessions"), 1);
  EXPECT_EQ(sample(page, "ecorche_frames_sent_total"), 6);
  EXPECT_EQ(sample(page, "ecorche_stage_seconds_count{stage=\"posed\"}"), 5);
  EXPECT_EQ(sample(page, "ecorche_stage_seconds_count{stage=\"waited\"}"), 5);
  EXPECT_EQ(sample(page, "ecorche_stage_seconds_count{stage=\"encoded\"}"), 6);
  EXPECT_GT(sample(page, "ecorche_stage_seconds_sum{stage=\"encoded\"}"), 0);
  EXPECT_EQ(sample(page, "ecorche_stage_seconds_count{stage=\"written\"}"), 6);
  EXPECT_EQ(sample(page, "ecorche_limits_hit_total{limit=\"subscriptions\"}"), 1);
  EXPECT_EQ(sample(page, "ecorche_sent_bytes_total"), static_cast<double>(client.client().bytes_received()));
}

TEST(Web, RequestsBeyondTheRateAreTurnedAway) {
  Options options = with_http();
  options.limits.requests_per_second = 4;
  const TestServer server(options);
  int alive = 0, turned_away = 0;
  for (int i = 0; i < 40; ++i) {
    const std::string answer = WebClient(server.http()).get("/nothing");
    alive += starts(answer, "HTTP/1.1 404");
    turned_away += starts(answer, "HTTP/1.1 429");
  }
  EXPECT_GE(alive, 4);  // a second's worth at once
  EXPECT_EQ(alive + turned_away, 40);
  EXPECT_GT(turned_away, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  const std::string page = WebClient(server.http()).get("/metrics");
  EXPECT_EQ(sample(page, "ecorche_limits_hit_total{limit=\"requests\"}"), turned_away);
}

TEST(Web, WhatIsNoHttpIsRefused) {
  const TestServer server(with_http());
  WebClient noise(server.http());
  noise.send("\x16\x03\x01 what is this\r\n\r\n");
  EXPECT_TRUE(starts(noise.rest(), "HTTP/1.1 400"));
  WebClient greedy(server.http());
  greedy.send("GET /healthz HTTP/1.1\r\nX: " + std::string(5000, 'x'));
  EXPECT_TRUE(starts(greedy.rest(), "HTTP/1.1 431"));
  EXPECT_TRUE(starts(WebClient(server.http()).get("/healthz"), "HTTP/1.1 200"));
}

TEST(Web, ASilentOrSlowRequestIsDroppedByDeadline) {
  Options options = with_http();
  options.limits.hello_seconds = 0.2;
  const TestServer server(options);
  WebClient silent(server.http()), half(server.http());
  half.send("GET /healthz HT");
  EXPECT_EQ(silent.rest(5), "");
  EXPECT_EQ(half.rest(5), "");
  WebClient upgraded(server.http());
  ASSERT_TRUE(starts(upgraded.upgrade(), "HTTP/1.1 101"));
  const auto last = upgraded.frame();  // says why, then closes
  ASSERT_TRUE(last);
  EXPECT_EQ(last->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::deadline_exceeded));
  EXPECT_FALSE(upgraded.message());
}

TEST(WebSocketTest, CarriesTheSameFramesAsTcp) {
  const TestServer server(with_http());
  WebClient web(server.http());
  const std::string head = web.upgrade();
  EXPECT_TRUE(starts(head, "HTTP/1.1 101")) << head;
  EXPECT_NE(head.find("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), std::string::npos);  // RFC 6455, 1.3
  EXPECT_NE(head.find("ecorche.v1"), std::string::npos);
  web.send_frame(greeting());
  ASSERT_TRUE(web.frame()->envelope.has_server_hello());

  TestClient poser(server, "shared");
  poser.subscribe_mesh();
  v1::Envelope open;
  open.mutable_open_model()->set_session("shared");
  web.send_frame(open);
  const auto opened = web.frame();
  ASSERT_TRUE(opened && opened->envelope.has_model_opened());
  EXPECT_GT(opened->payload.size(), 0U);
  v1::Envelope subscribe;
  subscribe.mutable_subscribe()->mutable_mesh();
  web.send_frame(subscribe);
  poser.send(1, poser.bent(0.4));
  const wire::Frame there = poser.next_mesh(1);
  for (int i = 0; i < 5; ++i) {
    const auto here = web.frame();
    ASSERT_TRUE(here);
    if (here->envelope.mesh_frame().pose_sequence() != 1) continue;
    EXPECT_EQ(here->payload, there.payload);
    EXPECT_EQ(here->envelope.SerializeAsString(), there.envelope.SerializeAsString());
    return;
  }
  FAIL() << "the frame did not come";
}

TEST(WebSocketTest, AMessageMayComeInFragmentsButHoldsOneFrame) {
  const TestServer server(with_http());
  const std::string frame = wire::encode(greeting()).head;
  WebClient fragments(server.http());
  fragments.upgrade();
  fragments.send_message(frame.substr(0, 3), 2, false);
  fragments.send_message("are you there", 9);  // a ping between them
  fragments.send_message("", 0, false);
  fragments.send_message(frame.substr(3), 0, true);
  ASSERT_TRUE(fragments.frame()->envelope.has_server_hello());

  for (const std::string& wrong : {frame + frame, frame.substr(0, 10), std::string("\0", 1)}) {
    WebClient client(server.http());
    client.upgrade();
    client.send_message(wrong);
    std::optional<wire::Frame> last;
    while (auto next = client.frame()) last = std::move(next);
    ASSERT_TRUE(last) << wrong.size();
    EXPECT_EQ(last->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::invalid_argument));
  }
}

TEST(WebSocketTest, HandshakesThatAreNotOursAreRefused) {
  Options options = with_http();
  options.origins = {"https://viewer.example"};
  const TestServer server(options);
  const std::string ours = "Sec-WebSocket-Protocol: chat, ecorche.v1\r\n";
  EXPECT_TRUE(
      starts(WebClient(server.http()).upgrade("Origin: https://viewer.example\r\n" + ours), "HTTP/1.1 101"));
  EXPECT_TRUE(
      starts(WebClient(server.http()).upgrade("Origin: https://evil.example\r\n" + ours), "HTTP/1.1 403"));
  EXPECT_TRUE(starts(WebClient(server.http()).upgrade("Sec-WebSocket-Protocol: chat\r\n"), "HTTP/1.1 400"));
  EXPECT_TRUE(starts(WebClient(server.http()).get("/v1"), "HTTP/1.1 426"));
}

// Pings and empty pieces are answered and dropped below what counts messages; they wait as messages do.
TEST(WebSocketTest, WhatIsNoMessageWaitsBeyondTheRateToo) {
  constexpr int kMany = 1200;  // of 6 bytes; the last 1536 are read at once
  const auto seconds = [&](double rate, int opcode) {
    Options options = with_http();
    options.limits.messages_per_second = rate;
    const TestServer server(options);
    Greeted client(server);
    v1::Envelope ping;
    ping.set_request_id(2);
    ping.mutable_ping();
    const std::string message = wire::encode(ping).head;
    const auto start = client::Clock::now();
    if (opcode == 0) client.send_message(message.substr(0, 8), 2, false);
    for (int i = 0; i < kMany; ++i) client.send_message({}, opcode, opcode != 0);
    if (opcode == 0)
      client.send_message(message.substr(8), 0);
    else
      client.send_message(message);
    const auto pong = client.frame();
    EXPECT_TRUE(pong && pong->envelope.has_pong());
    return std::chrono::duration<double>(client::Clock::now() - start).count();
  };
  for (const int opcode : {9, 0}) {
    EXPECT_GE(seconds(1000, opcode), 0.5) << opcode;
    EXPECT_LT(seconds(1e5, opcode), 0.5) << opcode;
  }
}

// What is claimed as messages costs nothing more, however long they are.
TEST(WebSocketTest, LongMessagesDoNotWait) {
  const TestServer server(with_http());
  Greeted client(server);
  v1::Envelope ping;
  ping.mutable_ping()->set_data(std::string(60'000, 'x'));
  const auto start = client::Clock::now();
  for (std::uint64_t i = 1; i <= 20; ++i) {
    ping.set_request_id(i);
    client.send_frame(ping);
    EXPECT_TRUE(client.frame());
  }
  EXPECT_LT(std::chrono::duration<double>(client::Clock::now() - start).count(), 5);
}

// A message may come in as many pieces as it likes, but each counts.
TEST(WebSocketTest, AMessageInManyPiecesCountsAsMany) {
  Options options = with_http();
  options.limits.messages_per_second = 50;
  const TestServer server(options);
  Greeted client(server);
  v1::Envelope ping;
  ping.set_request_id(2);
  ping.mutable_ping()->set_data(std::string(100, 'x'));
  const std::string message = wire::encode(ping).head;
  const auto start = client::Clock::now();
  for (std::size_t i = 0; i < message.size(); ++i)
    client.send_message(message.substr(i, 1), i == 0 ? 2 : 0, i + 1 == message.size());
  EXPECT_TRUE(client.frame());
  // A second's worth may come at once.
  const double most = static_cast<double>(message.size()) / 50 - 1;
  EXPECT_GE(std::chrono::duration<double>(client::Clock::now() - start).count(), 0.8 * most);
}

TEST(WebSocketTest, FourKibibytesBeforeTheHelloAndNoMore) {
  const TestServer server(with_http());
  WebClient client(server.http());
  client.upgrade();
  v1::Envelope large = greeting();
  large.mutable_client_hello()->set_token(std::string(5000, 'x'));
  client.send_frame(large);
  const auto last = client.frame();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::resource_exhausted));
}

TEST(WebSocketTest, AClientThatClosesIsClosedProperly) {
  const TestServer server(with_http());
  Greeted client(server);
  client.send_message(std::string("\x03\xe8", 2), 8);
  EXPECT_EQ(client.rest(), std::string("\x88\x02\x03\xe8", 4));
}

}  // namespace
}  // namespace ecorche::server
