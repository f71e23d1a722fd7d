// SPDX-License-Identifier: Apache-2.0
// What one client may have of what all share: by address, and by connection.
#include "runtime/server/resources/shares.hpp"

#include <spdlog/spdlog.h>

#include <boost/asio/read.hpp>

#include "runtime/server/resources/journal.hpp"
#include "runtime/server/session/retained_bytes.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"
#include "tests/unit/server/web_client.hpp"

namespace ecorche::server {
namespace {

// A client at another address of this machine.
class Elsewhere {
 public:
  explicit Elsewhere(const wire::Address& server, const std::string& from = "127.0.0.2") : socket_(io_) {
    socket_.open(tcp::v4());
    socket_.bind({net::ip::make_address(from), 0});
    socket_.connect({net::ip::make_address(server.host), server.port});
  }
  void send(const std::string& bytes) { net::write(socket_, net::buffer(bytes)); }
  // What the server says until it has hung up.
  std::string rest() {
    std::string bytes;
    boost::system::error_code ec;
    net::read(socket_, net::dynamic_buffer(bytes), ec);
    return bytes;
  }
  // Whether the hello is answered by the server's.
  bool greeted() {
    send(wire::encode(greeting()).head);
    wire::FrameReader reader({.envelope_bytes = 1 << 20, .payload_bytes = 1 << 20});
    boost::system::error_code ec;
    while (!reader.complete()) {
      const auto spec = reader.prepare();
      net::read(socket_, net::buffer(spec.data(), spec.size()), ec);
      if (ec || !reader.commit(spec.size()).ok()) return false;
    }
    return reader.release().envelope.has_server_hello();
  }

 private:
  net::io_context io_;
  tcp::socket socket_;
};

TEST(Shares, ClientsOfOneAddressAreOne) {
  EXPECT_EQ(address_of("127.0.0.1:4711"), "127.0.0.1");
  EXPECT_EQ(address_of("::1:4711"), "::1");
  EXPECT_EQ(address_of("::ffff:192.0.2.7:80"), "192.0.2.7");
  EXPECT_EQ(address_of("2001:db8:1:2:3:4:5:6:80"), "2001:db8:1:2::/64");
  EXPECT_EQ(address_of("2001:db8:1:2:ffff::1:80"), "2001:db8:1:2::/64");
  EXPECT_EQ(address_of("?"), "?");
  EXPECT_EQ(portion(256, 0.75), 192U);
  EXPECT_EQ(portion(2, 0.75), 2U);
  EXPECT_EQ(portion(1, 0.01), 1U);
}

TEST(Shares, EachHasARateOfItsOwn) {
  Rates rates(2, 4);
  const auto start = Clock::now();
  const auto taken = [&](const std::string& who, Clock::time_point now) {
    int count = 0;
    while (count < 100 && rates.take(who, now)) ++count;
    return count;
  };
  EXPECT_EQ(taken("a", start), 4);
  EXPECT_EQ(taken("b", start), 4);
  EXPECT_EQ(taken("a", start + std::chrono::seconds(1)), 2);
  EXPECT_EQ(taken("a", start + std::chrono::hours(1)), 4);
  // However many there are, few are known; those beyond share one.
  for (int i = 0; i < 10000; ++i) rates.take(std::to_string(i), start + std::chrono::hours(1));
  EXPECT_EQ(rates.known(), Rates::most_known);
  EXPECT_EQ(taken("late", start + std::chrono::hours(1)), 0);
  EXPECT_EQ(taken("late", start + std::chrono::hours(2)), 4);
  EXPECT_EQ(rates.known(), 1U) << "who did nothing for long is forgotten";
}

LogLine about(int connection) {
  return {.text = "ended", .connection = static_cast<std::uint64_t>(connection), .peer = "10.0.0.1:80"};
}

TEST(Shares, AFloodOfBadClientsWritesFewLines) {
  const auto level = spdlog::get_level();
  spdlog::set_level(spdlog::level::info);  // servers of other tests are silent
  std::vector<std::string> lines;
  Journal journal(2, [&](Journal::Level, const LogLine& line) { lines.push_back(text_of(line)); });
  for (int i = 0; i < 7000; ++i) journal.line(spdlog::level::info, about(i), "10.0.0.1");
  EXPECT_EQ(lines.size(), 20U);
  journal.line(spdlog::level::info, about(7001), "10.0.0.2");
  ASSERT_EQ(lines.size(), 21U) << "another address has its own";
  EXPECT_EQ(lines.back(), "#7001 10.0.0.1:80: ended");
  journal.tick(Clock::now());
  EXPECT_EQ(lines.size(), 21U);
  journal.tick(Clock::now() + Journal::report_interval);
  ASSERT_EQ(lines.size(), 22U);
  EXPECT_EQ(lines.back(), "log: 6980 more lines in 10 s (raise --log-rate to see them)");
  journal.tick(Clock::now() + 2 * Journal::report_interval);
  EXPECT_EQ(lines.size(), 22U) << "nothing was left out since";
  // From however many addresses.
  for (int i = 0; i < 7000; ++i)
    journal.line(spdlog::level::info, about(1),
                 "10.0." + std::to_string(i / 250) + "." + std::to_string(i % 250));
  EXPECT_LE(lines.size(), 22U + 200U);
  const std::size_t written = lines.size();
  journal.line(spdlog::level::debug, "of no level that is written");
  EXPECT_EQ(lines.size(), written);
  spdlog::set_level(level);
}

TEST(Shares, OneKindOfRequestKeepsNoOtherOut) {
  Options options;
  options.http = Endpoint{};
  options.token = "sixteen letters!";
  options.limits.requests_per_second = 5;
  const TestServer server(options);
  const auto get = [&](const std::string& target, const std::string& headers = {}) {
    return WebClient(server.http()).get(target, headers);
  };
  const auto flood = [&](auto&& ask) {
    int turned_away = 0;
    for (int i = 0; i < 30; ++i) turned_away += starts(ask(), "HTTP/1.1 429") ? 1 : 0;
    EXPECT_GT(turned_away, 5);
    EXPECT_TRUE(starts(get("/healthz"), "HTTP/1.1 200"));
    EXPECT_TRUE(starts(get("/readyz"), "HTTP/1.1 200"));
  };
  flood([&] { return get("/"); });
  flood([&] { return get("/v1"); });  // which is no handshake
  EXPECT_TRUE(starts(WebClient(server.http()).upgrade(), "HTTP/1.1 101"));
  flood([&] { return WebClient(server.http()).upgrade(); });
  // Who has the token, and who is elsewhere, is let in.
  const std::string token = "Authorization: Bearer sixteen letters!\r\n";
  EXPECT_TRUE(starts(get("/metrics", token), "HTTP/1.1 200"));
  EXPECT_TRUE(starts(WebClient(server.http()).upgrade(token + "Sec-WebSocket-Protocol: ecorche.v1\r\n"),
                     "HTTP/1.1 101"));
  Elsewhere other(server.http());
  other.send("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_TRUE(starts(other.rest(), "HTTP/1.1 404"));
}

TEST(Shares, OneAddressHasNotAllConnections) {
  Limits limits;
  limits.connections = 4;
  limits.hello_seconds = 60;
  const TestServer server(limits);
  const TestClient a(server), b(server), c(server);
  RawClient fourth(server);
  const auto told = fourth.receive();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->envelope.status().message(),
            "connection: 3 clients of your address are connected (try again later)");
  Elsewhere other(server.address());
  EXPECT_TRUE(other.greeted());
  Elsewhere late(server.address());
  EXPECT_FALSE(late.greeted()) << "now all are taken";
}

TEST(Shares, OneAddressHasNotAllSessions) {
  Limits limits;
  limits.sessions = 4;
  const TestServer server(limits);
  const TestClient a(server), b(server), c(server);
  client::Client fourth(server.address(), "test");
  v1::Envelope open;
  open.mutable_open_model();
  try {
    fourth.call(open);
    ADD_FAILURE() << "it is open";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("3 sessions of your address are open"), std::string::npos)
        << error.what();
  }
}

TEST(Shares, OneConnectionKeepsNotAll) {
  const Model toy = test::toy_model();
  const VolumeSpec spec;
  const std::uint64_t one = kept_by(toy, spec, rest_voxels(toy, spec));
  Limits limits;
  limits.kept_bytes = 10 * one;
  limits.connection_share = 0.2;
  limits.peer_share = 0.3;
  const TestServer server(limits);
  TestClient a(server), b(server);
  const auto keeps = [&](TestClient& client, double rate) {
    v1::Envelope request;
    request.mutable_subscribe()->set_max_rate(rate);
    request.mutable_subscribe()->mutable_volume()->set_volume(toy.volumes[0].name);
    return error_of_call(client.client(), request) == ErrorKind::internal;
  };
  EXPECT_TRUE(keeps(a, 1));
  EXPECT_TRUE(keeps(a, 2));
  EXPECT_FALSE(keeps(a, 3)) << "two are a fifth";
  EXPECT_TRUE(keeps(b, 1));
  EXPECT_FALSE(keeps(b, 2)) << "three are what one address has";
  v1::Envelope unsubscribe;
  unsubscribe.mutable_unsubscribe()->set_subscription(1);
  a.client().call(unsubscribe);
  EXPECT_TRUE(keeps(b, 2)) << "and are given back";
}

TEST(Shares, AFrameHasALimit) {
  Limits limits;
  limits.frame_bytes = 16 << 20;
  const TestServer server(limits);
  TestClient client(server);
  v1::Envelope request;
  v1::VolumeSelection& volume = *request.mutable_subscribe()->mutable_volume();
  volume.set_volume(client.opened().volumes(0).name());
  for (int i = 0; i < 16; ++i) {
    v1::Slice& slice = *volume.add_slices();
    slice.mutable_origin();
    slice.mutable_u()->set_x(1);
    slice.mutable_v()->set_y(1);
    slice.set_size_u(4096);
    slice.set_size_v(4096);
  }
  try {
    client.client().call(request);
    ADD_FAILURE() << "it is there";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("ask for a region, fewer slices or fewer tissues"),
              std::string::npos)
        << error.what();
  }
  client.subscribe_mesh();
  client.next_mesh(0);
}

}  // namespace
}  // namespace ecorche::server
