// SPDX-License-Identifier: Apache-2.0
// Frames through a TCP socket: every byte in order, in turns with others, to the end or to an error.
#include "runtime/server/net/transport.hpp"

#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <boost/asio/read.hpp>
#include <boost/asio/socket_base.hpp>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "tests/unit/server/forwarding_transport.hpp"

namespace ecorche::server {
namespace {

using Bytes = std::vector<std::byte>;

// A transport and the client at its other end; nothing runs until run().
struct Pair {
  net::io_context own{1};
  net::io_context& io = own;
  tcp::socket client{io};
  int server = -1;  // the transport's
  std::unique_ptr<Transport> transport;
  boost::system::error_code ec;
  bool written = false;

  Pair() { connect(); }
  explicit Pair(net::io_context& with) : io(with) { connect(); }

  void connect() {
    tcp::acceptor acceptor(io, tcp::endpoint(net::ip::address_v4::loopback(), 0));
    client.connect(acceptor.local_endpoint());
    tcp::socket accepted = acceptor.accept();
    server = accepted.native_handle();
    transport = tcp_transport(std::move(accepted));
  }
  void write(std::vector<net::const_buffer> frame) {
    net::co_spawn(
        io,
        [this, frame = std::move(frame)]() -> net::awaitable<void> {
          co_await transport->write(frame, ec);
          written = true;
        },
        net::detached);
  }
};

Bytes noise(std::size_t size) {
  std::mt19937 random(7);
  Bytes bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

// More pieces than go in one call, empty ones among them, and more bytes than the socket holds.
TEST(TcpTransport, EveryByteInOrder) {
  Pair pair;
  const Bytes sent = noise(9 << 20);
  std::vector<net::const_buffer> frame;
  std::size_t at = 0;
  const auto cut = [&](std::size_t size) {
    frame.push_back(net::buffer(&sent[at], size));
    at += size;
  };
  cut(0);
  for (std::size_t i = 0; i < 300; ++i) cut(i % 7);
  cut(3 << 20);
  cut(0);
  for (std::size_t i = 0; i < 100; ++i) cut(8191);
  frame.push_back(net::buffer(&sent[at], sent.size() - at));
  frame.emplace_back();
  pair.write(frame);
  Bytes got(sent.size());
  std::thread reader([&] { net::read(pair.client, net::buffer(got)); });
  pair.io.run();
  reader.join();
  EXPECT_TRUE(pair.written);
  EXPECT_FALSE(pair.ec) << pair.ec.message();
  EXPECT_TRUE(got == sent);
}

TEST(TcpTransport, NothingToWrite) {
  Pair pair;
  pair.write({{}, {}});
  pair.io.run();
  EXPECT_TRUE(pair.written);
  EXPECT_FALSE(pair.ec);
}

// However much the socket takes, a turn of the I/O thread gives it half a megabyte of a large frame.
TEST(TcpTransport, ATurnIsShort) {
  Pair pair;
  const Bytes sent(std::size_t{16} << 20);
  Bytes got(sent.size());
  pair.write({net::buffer(sent)});
  std::thread reader([&] { net::read(pair.client, net::buffer(got)); });
  pair.io.run();  // the kernel has made its buffers larger meanwhile
  reader.join();
  pair.io.restart();
  pair.write({net::buffer(sent)});
  const auto on_its_way = [&] {
    int unacknowledged = 0;
    EXPECT_EQ(ioctl(pair.server, SIOCOUTQ, &unacknowledged), 0);
    return std::max(pair.client.available(), static_cast<std::size_t>(unacknowledged));
  };
  while (on_its_way() == 0) ASSERT_EQ(pair.io.poll_one(), 1U);
  EXPECT_LE(on_its_way(), 512U << 10);
}

// A large frame does not keep the I/O thread to itself, however fast its client reads.
TEST(TcpTransport, OthersHaveTheirTurns) {
  Pair pair;
  const Bytes sent(std::size_t{16} << 20);
  Bytes got(sent.size());
  pair.write({net::buffer(sent)});
  int turns = 0;
  std::function<void()> other = [&] {
    ++turns;
    if (!pair.written) net::post(pair.io, other);
  };
  net::post(pair.io, other);
  std::thread reader([&] { net::read(pair.client, net::buffer(got)); });
  pair.io.run();
  reader.join();
  EXPECT_GE(turns, 30);
}

// However many large frames are written at once, all else comes between any two parts of them.
TEST(TcpTransport, OnePartOfAllLargeFramesATurn) {
  const Bytes sent(std::size_t{16} << 20);
  net::io_context io{1};
  std::vector<std::unique_ptr<Pair>> pairs;
  for (int i = 0; i < 8; ++i) {
    pairs.push_back(std::make_unique<Pair>(io));
    pairs.back()->write({net::buffer(sent)});
  }
  const auto on_its_way = [&] {
    std::size_t all = 0;
    for (const auto& pair : pairs) {
      int unacknowledged = 0;
      EXPECT_EQ(ioctl(pair->server, SIOCOUTQ, &unacknowledged), 0);
      all += pair->client.available() + static_cast<std::size_t>(unacknowledged);
    }
    return all;
  };
  int turns = 0;
  std::size_t before = 0, most = 0;
  std::function<void()> other = [&] {
    const std::size_t now = on_its_way();
    if (turns > 1) most = std::max(most, now - std::min(now, before));  // once all have begun
    before = now;
    if (++turns < 20) net::post(io, other);
  };
  net::post(io, other);
  while (turns < 20) ASSERT_GT(io.poll_one(), 0U);
  EXPECT_GT(most, 0U);
  EXPECT_LE(most, 200U << 10);
  // Whoever stops waits for nobody, and nobody for it.
  pairs[3]->transport->close();
  pairs[5]->transport->close();
  std::vector<std::thread> readers;
  readers.reserve(pairs.size());
  for (const auto& pair : pairs) {
    readers.emplace_back([&pair] {
      Bytes got(std::size_t{16} << 20);
      boost::system::error_code ec;
      net::read(pair->client, net::buffer(got), ec);
    });
  }
  io.run();
  for (std::thread& reader : readers) reader.join();
  for (std::size_t i = 0; i < pairs.size(); ++i) EXPECT_EQ(!pairs[i]->ec, i != 3 && i != 5) << i;
}

// What the kernel holds for who does not read is a few parts, not what its buffers could grow to.
TEST(TcpTransport, LittleIsKeptForWhoDoesNotRead) {
  Pair pair;
  const Bytes sent(std::size_t{16} << 20);
  pair.write({net::buffer(sent)});
  pair.io.run_for(std::chrono::milliseconds(200));
  int unsent = 0;
  ASSERT_EQ(ioctl(pair.server, SIOCOUTQNSD, &unsent), 0);
  EXPECT_GT(unsent, 0);
  EXPECT_LE(unsent, 2 << 20);
}

// What stands between passes on when bytes left, too: without it, who takes a long write slowly would be
// dropped in a test, and in use not.
TEST(TcpTransport, TellsWhenBytesMoved) {
  Pair pair;
  pair.transport = std::make_unique<ForwardingTransport>(std::move(pair.transport));
  EXPECT_FALSE(pair.transport->moved());
  const auto before = Clock::now();
  const Bytes sent(16);
  pair.write({net::buffer(sent)});
  pair.io.run();
  ASSERT_TRUE(pair.transport->moved());
  EXPECT_GE(*pair.transport->moved(), before);
  EXPECT_LE(*pair.transport->moved(), Clock::now());
}

TEST(TcpTransport, ClientGoesAway) {
  Pair pair;
  const Bytes sent(std::size_t{16} << 20);
  Bytes some(1 << 20);
  pair.write({net::buffer(sent)});
  std::thread reader([&] {
    net::read(pair.client, net::buffer(some));
    pair.client.close();
  });
  pair.io.run();
  reader.join();
  EXPECT_TRUE(pair.written);
  EXPECT_TRUE(pair.ec == net::error::connection_reset || pair.ec == net::error::broken_pipe)
      << pair.ec.message();
}

TEST(TcpTransport, ClosedWhileNobodyReads) {
  Pair pair;
  const Bytes sent(std::size_t{64} << 20);
  pair.write({net::buffer(sent)});
  net::steady_timer timer(pair.io, std::chrono::milliseconds(50));
  timer.async_wait([&](const boost::system::error_code&) { pair.transport->close(); });
  pair.io.run();
  EXPECT_TRUE(pair.written);
  EXPECT_EQ(pair.ec, net::error::operation_aborted);
}

}  // namespace
}  // namespace ecorche::server
