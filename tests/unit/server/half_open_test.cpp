// SPDX-License-Identifier: Apache-2.0
// Connections without a hello keep nobody out who has one.
#include "tests/unit/server/test_server.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

// Nobody is dropped by a deadline here.
Options few(std::uint32_t connections) {
  Options options;
  options.http = Endpoint{};
  options.limits.connections = connections;
  options.limits.hello_seconds = 60;
  options.limits.peer_share = 1;
  return options;
}

template <class Client>
std::vector<std::unique_ptr<Client>> several(int count, const auto& where) {
  std::vector<std::unique_ptr<Client>> clients;
  clients.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) clients.push_back(std::make_unique<Client>(where));
  return clients;
}

// Until those who have come so far have had their time for a hello.
void wait() {
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
}

bool greeted(RawClient& client) {
  client.send_hello();
  const auto answer = client.receive();
  return answer && answer->envelope.has_server_hello();
}

bool answers(RawClient& client) {
  v1::Envelope ping;
  ping.mutable_ping();
  client.send(ping);
  const auto answer = client.receive();
  return answer && answer->envelope.has_pong();
}

TEST(HalfOpen, TheOldestSilentConnectionMakesWay) {
  const TestServer server(few(4));
  const auto silent = several<RawClient>(4, server);
  wait();
  TestClient client(server);
  client.subscribe_mesh();
  client.next_mesh(0);
  const auto last = silent[0]->receive();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->envelope.status().code(), static_cast<std::uint32_t>(StatusCode::resource_exhausted));
  EXPECT_NE(last->envelope.status().message().find("hello: none came, and another client took the place"),
            std::string::npos);
  EXPECT_TRUE(silent[0]->hung_up());
  // The others are still in time.
  for (std::size_t i = 1; i < 4; ++i) EXPECT_TRUE(greeted(*silent[i])) << i;
}

TEST(HalfOpen, WhoHasGreetedStays) {
  const TestServer server(few(3));
  const auto clients = several<RawClient>(3, server);
  EXPECT_TRUE(greeted(*clients[0]));
  EXPECT_TRUE(greeted(*clients[2]));
  wait();
  RawClient third(server);  // in place of the silent one between
  EXPECT_TRUE(greeted(third));
  EXPECT_TRUE(clients[1]->hung_up());
  wait();
  RawClient late(server);
  EXPECT_EQ(late.last_words(), StatusCode::resource_exhausted);
  for (RawClient* client : {clients[0].get(), clients[2].get(), &third}) EXPECT_TRUE(answers(*client));
}

TEST(HalfOpen, WhoHasJustComeHasTimeForItsHello) {
  bool refused = false, kept = false;
  for (int tries = 0; tries < 20 && !(refused && kept); ++tries) {  // on a busy machine time is soon over
    const TestServer server(few(2));
    const auto clients = several<RawClient>(2, server);
    RawClient late(server);
    refused = !greeted(late);
    kept = greeted(*clients[0]) && greeted(*clients[1]);
  }
  EXPECT_TRUE(refused);
  EXPECT_TRUE(kept);
}

// However many come and are silent: those who make way are told so no longer than there is room for it.
TEST(HalfOpen, ManyMakeWayAtOnce) {
  const TestServer server(few(60));
  const auto first = several<RawClient>(60, server);
  wait();
  const auto second = several<RawClient>(60, server);
  int told = 0;
  for (const auto& client : first) told += client->last_words() == StatusCode::resource_exhausted ? 1 : 0;
  EXPECT_GE(told, 16);
  for (const auto& client : second) EXPECT_TRUE(greeted(*client));
}

TEST(HalfOpen, ARequestOverHttpMakesWayToo) {
  const TestServer server(few(4));
  const auto silent = several<WebClient>(4, server.http());
  wait();
  EXPECT_EQ(WebClient(server.http()).get("/healthz").rfind("HTTP/1.1 200", 0), 0U);
  EXPECT_TRUE(silent[0]->get("/healthz").empty());  // hung up
  EXPECT_EQ(silent[3]->get("/healthz").rfind("HTTP/1.1 200", 0), 0U);
  const std::string page = WebClient(server.http()).get("/metrics");
  EXPECT_NE(page.find("ecorche_limits_hit_total{limit=\"hello\"}"), std::string::npos) << page;
}

TEST(HalfOpen, AWebSocketTakesTheSilentOnesPlaceToo) {
  const TestServer server(few(4));
  const auto silent = several<RawClient>(4, server);
  wait();
  WebClient web(server.http());
  EXPECT_EQ(web.upgrade().rfind("HTTP/1.1 101", 0), 0U);
  v1::Envelope hello;
  hello.mutable_client_hello()->set_protocol_min(1);
  hello.mutable_client_hello()->set_protocol_max(1);
  web.send_frame(hello);
  const auto answer = web.frame();
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->envelope.has_server_hello());
  EXPECT_TRUE(silent[0]->hung_up());
}

// Where nobody has had its time yet, the next request is closed without a word.
TEST(HalfOpen, ARequestTooManyIsRefused) {
  bool refused = false;
  for (int tries = 0; tries < 20 && !refused; ++tries) {
    const TestServer server(few(2));
    const auto requests = several<WebClient>(2, server.http());
    refused = WebClient(server.http()).get("/healthz").empty();
  }
  EXPECT_TRUE(refused);
}

// A crowd that comes at once is let in one by one, so that others have their turns between; and all are.
TEST(Newcomers, ComeOneAfterAnother) {
  constexpr std::size_t kCrowd = 60;
  std::vector<Clock::time_point> came;
  {
    const TestServer server(few(100), {.transport =
                                           [&](std::unique_ptr<Transport> transport) {
                                             came.push_back(Clock::now());
                                             return transport;
                                           },
                                       .timer_fails = {},
                                       .handling = {}});
    const auto crowd = several<RawClient>(kCrowd, server);
    for (const auto& client : crowd) EXPECT_TRUE(greeted(*client));
  }
  ASSERT_EQ(came.size(), kCrowd);
  EXPECT_GE(came.back() - came.front(), (kCrowd - 1) * std::chrono::microseconds(500));
}

// What a client has waited in the kernel is of its time for a hello.
TEST(Newcomers, HaveWaitedSinceTheyConnected) {
  net::io_context io;
  tcp::acceptor acceptor(io, {net::ip::address_v4::loopback(), 0});
  tcp::socket client(io);
  client.connect(acceptor.local_endpoint());
  const auto begun = Clock::now();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  tcp::socket accepted = acceptor.accept();
  const Clock::duration time = waited(accepted);
  EXPECT_GE(time, std::chrono::milliseconds(150));
  EXPECT_LE(time, Clock::now() - begun + std::chrono::milliseconds(50));
}

}  // namespace
}  // namespace ecorche::server
