// SPDX-License-Identifier: Apache-2.0
// Who reads slowly stays, who stops reading is dropped: by when the carrier last took bytes of a write.
#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>

#include <atomic>
#include <boost/asio/read.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <filesystem>
#include <functional>
#include <optional>
#include <thread>
#include <vector>

#include "runtime/server/net/outbox.hpp"
#include "runtime/server/net/patience.hpp"
#include "runtime/server/net/tls.hpp"
#include "runtime/server/net/web.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/certificate.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

using std::chrono::milliseconds;

TEST(Patience, IsWithWhoTakesBytes) {
  const auto start = Clock::now();
  const auto at = [&](double seconds) { return start + duration(seconds); };
  const Writing write{.since = start, .bytes = 125'000 * 1000};  // 1000 s at the least rate
  const auto stalled = [&](const Writing& of, std::optional<Clock::time_point> moved) {
    return stalled_at(of, moved, duration(10), false);
  };
  EXPECT_EQ(stalled(write, std::nullopt), at(10));
  EXPECT_EQ(stalled(write, at(-3)), at(10));  // of an earlier write
  EXPECT_EQ(stalled(write, at(4)), at(14));
  EXPECT_EQ(stalled(write, at(900)), at(910));
  // Too slow on the whole.
  EXPECT_EQ(stalled(write, at(1005)), at(1010));
  EXPECT_EQ(stalled({.since = start, .bytes = 125'000}, at(4)), at(11));
}

TEST(Patience, IsNotLongerForWhoTakesBytesWhereItIsShort) {
  const auto start = Clock::now();
  const Writing write{.since = start, .bytes = 1 << 30};
  EXPECT_EQ(stalled_at(write, start + duration(9), duration(10), true), start + duration(10));
}

SharedFrame small_frame() {
  return std::make_shared<const wire::EncodedFrame>(wire::EncodedFrame{.head = "x", .payload = nullptr});
}

TEST(Patience, AnAcknowledgementIsAwaitedFromTheWritesEnd) {
  Outbox outbox(2);
  const auto start = Clock::now();
  for (const std::uint32_t subscription : {1U, 2U}) outbox.enqueue(subscription, 0, 1, 0, small_frame());
  outbox.next(start);
  EXPECT_EQ(outbox.oldest_in_flight(), start);
  EXPECT_FALSE(outbox.oldest_written());
  outbox.written(start + milliseconds(10));
  outbox.next(start + milliseconds(20));
  EXPECT_EQ(outbox.oldest_written(), start + milliseconds(10));
  outbox.acknowledge(1, 1, start + milliseconds(30));
  EXPECT_FALSE(outbox.oldest_written());  // the other one is being written
  outbox.written(start + milliseconds(40));
  EXPECT_EQ(outbox.oldest_written(), start + milliseconds(40));
  // A later one of the same subscription, and an answer, change nothing about it.
  outbox.enqueue(2, 0, 2, 0, small_frame());
  outbox.next(start + milliseconds(50));
  outbox.written(start + milliseconds(60));
  outbox.answer(small_frame());
  outbox.next(start + milliseconds(70));
  outbox.written(start + milliseconds(80));
  EXPECT_EQ(outbox.oldest_written(), start + milliseconds(40));
  outbox.acknowledge(2, 1, start + milliseconds(90));
  EXPECT_EQ(outbox.oldest_written(), start + milliseconds(60));
}

// What takes long to write is late: the way is slow, whoever made it so.
TEST(Patience, DelaysAreJudgedFromTheWritesBeginning) {
  Flow flow(2);
  auto now = Clock::now();
  flow.level(0, 3, now);
  for (std::uint64_t n = 1; n <= 2; ++n) {
    flow.left(n, now);
    flow.written(now + milliseconds(400));
    now += milliseconds(410);
    flow.arrived(n, now);
  }
  EXPECT_GT(flow.level(0, 3, now), 0U);
}

// How a dripping transport takes what comes with a payload.
struct Drip {
  std::atomic<int> parts = 0;  // so many, 50 ms apart
  bool moves = true, knows = true;
};

class DrippingTransport final : public Transport {
 public:
  DrippingTransport(std::unique_ptr<Transport> inner, const Drip& drip)
      : inner_(std::move(inner)), drip_(drip), pause_(inner_->executor()) {}

  net::any_io_executor executor() override { return inner_->executor(); }
  net::awaitable<void> open(boost::system::error_code& ec) override { return inner_->open(ec); }
  net::awaitable<std::size_t> read_some(std::span<std::byte> out, boost::system::error_code& ec) override {
    return inner_->read_some(out, ec);
  }
  net::awaitable<void> write(std::span<const net::const_buffer> frame,
                             boost::system::error_code& ec) override {
    const int parts = frame.size() < 2 ? 0 : drip_.parts.load();
    for (int part = 0; part < parts && !closed_; ++part) {
      pause_.expires_after(milliseconds(50));
      co_await pause_.async_wait(quietly(ec));
      if (drip_.moves) moved_ = Clock::now();
    }
    co_await inner_->write(frame, ec);
  }
  net::awaitable<void> finish(boost::system::error_code& ec) override { return inner_->finish(ec); }
  void close() override {
    closed_ = true;
    inner_->close();
    pause_.cancel();
  }
  std::optional<Clock::time_point> moved() const override { return drip_.knows ? moved_ : std::nullopt; }

 private:
  std::unique_ptr<Transport> inner_;
  const Drip& drip_;
  net::steady_timer pause_;
  std::optional<Clock::time_point> moved_;
  bool closed_ = false;
};

struct Case {
  const char* what;
  bool large;  // 1.2 MB: 9.4 s at the least rate; else some kB
  int parts;
  bool moves, knows;
  std::uint64_t queued_bytes;
  bool kept;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.what;
}

class SlowReading : public testing::TestWithParam<Case> {};

// Patience is 0.6 s, and in a crowd a quarter of that.
TEST_P(SlowReading, EndsWhereItIsTooSlow) {
  const Case& c = GetParam();
  Drip drip;
  drip.moves = c.moves;
  drip.knows = c.knows;
  Options options;
  options.limits.stall_seconds = 0.6;
  options.limits.queued_bytes = c.queued_bytes;
  const TestServer server(options,
                          {.transport =
                               [&](std::unique_ptr<Transport> inner) {
                                 return std::make_unique<DrippingTransport>(std::move(inner), drip);
                               },
                           .timer_fails = {},
                           .handling = {}},
                          test::fine_toy_model(8));
  TestClient client(server);
  drip.parts = c.parts;
  if (c.large)
    client.subscribe_volume(client.opened().volumes(0).name());
  else
    client.subscribe_mesh();
  const auto shown = [&] {
    return client.next([](const v1::Envelope& e) { return e.has_volume_frame() || e.has_mesh_frame(); });
  };
  const auto start = client::Clock::now();
  try {
    const wire::Frame frame = shown();
    EXPECT_TRUE(c.kept);
    EXPECT_GE(client::Clock::now() - start, milliseconds(1000));
    EXPECT_GE(frame.payload.size(), 1000U << 10);
    drip.parts = 0;
    client.send(1, client.bent(0.1));
    shown();
  } catch (const Error& error) {
    EXPECT_FALSE(c.kept) << error.what();
    EXPECT_EQ(error.kind(), ErrorKind::temporary);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Writes, SlowReading,
    testing::Values(Case{"much, part by part", true, 24, true, true, 1U << 29, true},
                    Case{"much, but nothing moves", true, 60, false, true, 1U << 29, false},
                    Case{"much, but nobody knows what moves", true, 60, true, false, 1U << 29, false},
                    Case{"little, part by part", false, 60, true, true, 1U << 29, false},
                    Case{"much, part by part, in a crowd", true, 60, true, true, 0, false}));

// A client's socket, and the server's of the same connection.
struct Sockets {
  explicit Sockets(net::io_context& io) : client(io), server(io) {
    tcp::acceptor acceptor(io, tcp::endpoint(net::ip::address_v4::loopback(), 0));
    client.connect(acceptor.local_endpoint());
    server = acceptor.accept();
    descriptor = server.native_handle();
  }
  int unsent() const {
    int bytes = 0;
    EXPECT_EQ(ioctl(descriptor, SIOCOUTQNSD, &bytes), 0);
    return bytes;
  }
  tcp::socket client, server;
  int descriptor;
};

// As long as the client reads nothing, nothing moves; once it does, something does, long before the end. And
// when it hangs up that is known, though nobody reads. `read`: has it read so many bytes.
void expect_movement(net::io_context& io, Transport& transport, Sockets& sockets,
                     const std::function<net::awaitable<void>(std::size_t)>& read) {
  const std::vector<std::byte> sent(std::size_t{48} << 20);
  const std::vector<net::const_buffer> frame{net::buffer(sent)};
  bool written = false, half = false;
  const auto start = Clock::now();
  net::co_spawn(
      io,
      [&]() -> net::awaitable<void> {
        boost::system::error_code ec;
        co_await transport.write(frame, ec);
        EXPECT_FALSE(ec) << ec.message();
        written = true;
      },
      net::detached);
  std::optional<Clock::time_point> before;
  do {
    before = transport.moved();
    io.restart();
    io.run_for(milliseconds(100));
  } while (!before || before != transport.moved());
  EXPECT_GE(*before, start);
  EXPECT_FALSE(written);
  EXPECT_LE(sockets.unsent(), 2 << 20);
  const auto reads = [&](std::size_t bytes) {
    half = false;
    net::co_spawn(
        io,
        [&, bytes]() -> net::awaitable<void> {
          co_await read(bytes);
          half = true;
        },
        net::detached);
    io.restart();
    while (!half) ASSERT_GT(io.run_one(), 0U);
  };
  reads(sent.size() / 2);
  EXPECT_FALSE(written);
  EXPECT_GT(*transport.moved(), *before);
  reads(sent.size() / 2);
  while (!written && io.run_one() > 0) {
  }
  EXPECT_TRUE(written);
  net::write(sockets.client, net::buffer("more", 4));
  EXPECT_FALSE(transport.hung_up());
  sockets.client.close();
  for (int i = 0; i < 1000 && !transport.hung_up(); ++i) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_TRUE(transport.hung_up());
}

// Everything of `stream`, which nobody looks at.
template <class Stream>
auto reading(Stream& stream) {
  return [&stream](std::size_t bytes) -> net::awaitable<void> {
    std::vector<std::byte> got(bytes);
    co_await net::async_read(stream, net::buffer(got), net::use_awaitable);
  };
}

TEST(Movement, OfTcp) {
  net::io_context io{1};
  Sockets sockets(io);
  const auto transport = tcp_transport(std::move(sockets.server));
  EXPECT_FALSE(transport->moved());
  expect_movement(io, *transport, sockets, reading(sockets.client));
}

TEST(Movement, OfTls) {
  const auto folder = std::filesystem::temp_directory_path() / ("ecorche_moves_" + random_token());
  std::filesystem::create_directories(folder);
  const std::string file = (folder / "server").string();
  ASSERT_TRUE(make_certificate(file));
  const Carrier carrier(file + ".pem", file + ".key");
  std::filesystem::remove_all(folder);
  net::io_context io{1};
  Sockets sockets(io);
  const auto transport = carrier.carry(std::move(sockets.server));
  net::ssl::context context(net::ssl::context::tls_client);
  net::ssl::stream<tcp::socket&> client(sockets.client, context);
  net::co_spawn(
      io,
      [&]() -> net::awaitable<void> {
        boost::system::error_code ec;
        co_await transport->open(ec);
        EXPECT_FALSE(ec) << ec.message();
      },
      net::detached);
  net::co_spawn(io, client.async_handshake(net::ssl::stream_base::client, net::use_awaitable), net::detached);
  io.run();
  EXPECT_FALSE(transport->moved());
  expect_movement(io, *transport, sockets, reading(client));
}

TEST(Movement, OfAWebSocketIsItsCarriers) {
  net::io_context io{1};
  Sockets sockets(io);
  std::unique_ptr<Transport> transport;
  WebContext context;
  context.hosts = HostList(net::ip::make_address("127.0.0.1"), {});
  context.admit = [](auto&&...) { return true; };
  context.welcome = [&](std::unique_ptr<Transport> welcomed, const std::string&,
                        const std::shared_ptr<const Pass>&) { transport = std::move(welcomed); };
  const auto request = web_request(tcp_transport(std::move(sockets.server)), "test", context);
  request->start();
  net::write(sockets.client, net::buffer(std::string(
                                 "GET /v1 HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
                                 "Connection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                                 "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: ecorche.v1\r\n\r\n")));
  while (!transport) ASSERT_GT(io.run_one(), 0U);
  expect_movement(io, *transport, sockets, reading(sockets.client));
}

}  // namespace
}  // namespace ecorche::server
