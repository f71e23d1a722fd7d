// SPDX-License-Identifier: Apache-2.0
// Frames through a TCP socket: every byte in order, in turns with others, to the end or to an error.
#include "runtime/server/transport.hpp"

#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <boost/asio/read.hpp>
#include <boost/asio/socket_base.hpp>
#include <random>
#include <thread>
#include <vector>

namespace ecorche::server {
namespace {

using Bytes = std::vector<std::byte>;

// A transport and the client at its other end; nothing runs until run().
struct Pair {
  net::io_context io{1};
  tcp::socket client{io};
  int server = -1;  // the transport's
  std::unique_ptr<Transport> transport;
  boost::system::error_code ec;
  bool written = false;

  Pair() {
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
