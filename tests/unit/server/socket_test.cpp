// SPDX-License-Identifier: Apache-2.0
// Servers that are not there, hang up, or stop reading.
#include <ecorche/client/socket.hpp>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <thread>
#include <vector>

#include <ecorche/values/error.hpp>

namespace ecorche::client {
namespace {

class Listener {
 public:
  Listener() : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    socklen_t size = sizeof address;
    EXPECT_EQ(::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
  }
  ~Listener() { close(); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  void listen() const { EXPECT_EQ(::listen(fd_, 1), 0); }
  int accept() const { return ::accept(fd_, nullptr, nullptr); }
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }
  wire::Address address() const { return {"127.0.0.1", port_}; }

 private:
  int fd_;
  std::uint16_t port_ = 0;
};

Clock::time_point soon() {
  return Clock::now() + std::chrono::milliseconds(300);
}

template <class F>
std::string problem(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::temporary);
    return error.problem();
  }
  return {};
}

TEST(ClientSocket, NobodyThere) {
  const Listener silent;
  EXPECT_EQ(problem([&] { Socket(silent.address(), soon()); }).find("cannot be reached: "), 0U);
}

TEST(ClientSocket, HangsUp) {
  const Listener listener;
  listener.listen();
  Socket socket(listener.address(), soon());
  ::close(listener.accept());
  std::array<std::byte, 8> bytes{};
  EXPECT_EQ(problem([&] { socket.read(bytes, soon()); }), "the server hung up");
}

// Of a large payload: a good part of it ends the wait, a little is there when time is up, the end at once.
TEST(ClientSocket, SleepsUntilAGoodPartHasCome) {
  const Listener listener;
  listener.listen();
  Socket socket(listener.address(), soon());
  const int peer = listener.accept();
  std::vector<std::byte> out(std::size_t{1} << 20), much(300'000), little(1000);
  const auto read_after = [&](const std::vector<std::byte>& sent, bool then_end, Clock::time_point until) {
    std::thread sender([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
      EXPECT_EQ(::send(peer, sent.data(), sent.size(), 0), static_cast<ssize_t>(sent.size()));
      if (then_end) ::close(peer);
    });
    const std::size_t got = socket.read(out, until, 256 << 10);
    sender.join();
    return got;
  };
  const auto late = Clock::now() + std::chrono::seconds(20);
  std::size_t got = read_after(much, false, late);
  EXPECT_GE(got, 256U << 10);
  while (got < much.size())
    got += socket.read(std::span(out).first(much.size() - got), late, much.size() - got);
  EXPECT_EQ(read_after(little, false, soon()), little.size());
  std::thread sender([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    EXPECT_EQ(::send(peer, little.data(), 1, 0), 1);
  });
  EXPECT_EQ(socket.read(out, late), 1U);  // whoever does not ask for more
  sender.join();
  // A few bytes are not worth sleeping for: what there is comes at once.
  const std::vector<std::byte> one(1);
  const auto then = Clock::now() + std::chrono::seconds(2);
  std::thread second([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    EXPECT_EQ(::send(peer, one.data(), 1, 0), 1);
  });
  EXPECT_EQ(socket.read(out, then, 1000), 1U);
  EXPECT_LT(Clock::now(), then);
  second.join();
  EXPECT_EQ(read_after(little, true, late), little.size());
  EXPECT_EQ(problem([&] { socket.read(out, soon()); }), "the server hung up");
  EXPECT_LT(Clock::now(), late);
}

TEST(ClientSocket, StopsReading) {
  const Listener listener;
  listener.listen();
  Socket socket(listener.address(), soon());
  const std::vector<std::byte> much(std::size_t{1} << 26);
  EXPECT_EQ(problem([&] { socket.write(much, soon()); }), "the server stopped reading");
}

}  // namespace
}  // namespace ecorche::client
