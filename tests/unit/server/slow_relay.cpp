// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/server/slow_relay.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <random>

#include <ecorche/values/error.hpp>

namespace ecorche::server {
namespace {

using Clock = std::chrono::steady_clock;

Clock::duration seconds(double s) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
}

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// Small, so that what the network does not carry waits at its sender.
void shrink(int fd) {
  const int bytes = 64 << 10, on = 1;
  setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

bool ready(int fd, short events, Clock::time_point until) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
  pollfd poll_fd{.fd = fd, .events = events, .revents = 0};
  return poll(&poll_fd, 1, static_cast<int>(std::clamp<std::int64_t>(left, 0, 20))) > 0;
}

struct Packet {
  Clock::time_point arrives;
  std::vector<char> bytes;
};

}  // namespace

SlowRelay::SlowRelay(const wire::Address& to, const Network& network) : to_(to), network_(network) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  shrink(listener_);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || listen(listener_, 8) != 0 ||
      getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    throw Error(ErrorKind::internal, "relay", "cannot listen", "see the test");
  port_ = ntohs(address.sin_port);
  threads_.emplace_back([this] { accept_all(); });
}

SlowRelay::~SlowRelay() {
  stop_ = true;
  threads_.front().join();
  for (std::size_t i = 1; i < threads_.size(); ++i) threads_[i].join();
  for (const int fd : sockets_) close(fd);
  close(listener_);
}

void SlowRelay::accept_all() {
  while (!stop_) {
    if (!ready(listener_, POLLIN, Clock::now() + seconds(1))) continue;
    const int from = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const int to = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    shrink(from);
    shrink(to);
    const sockaddr_in address = loopback(to_.port);
    if (connect(to, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      close(from);
      close(to);
      continue;
    }
    sockets_.insert(sockets_.end(), {from, to});
    const auto seed = static_cast<std::uint32_t>(threads_.size());
    threads_.emplace_back([this, from, to, seed] { carry(from, to, seed); });
    threads_.emplace_back([this, from, to, seed] { carry(to, from, seed + 1); });
  }
}

void SlowRelay::carry(int from, int to, std::uint32_t seed) const {
  std::mt19937 random(seed);
  std::deque<Packet> packets;
  std::size_t waiting = 0;
  auto wire_free = Clock::now(), last_arrival = wire_free;
  const auto on_the_wire = static_cast<std::size_t>(network_.bytes_per_second * 4 * network_.delay_seconds);
  while (!stop_) {
    const auto now = Clock::now();
    while (!packets.empty() && packets.front().arrives <= now) {
      std::vector<char>& bytes = packets.front().bytes;
      std::size_t done = 0;
      while (done < bytes.size() && !stop_) {
        if (!ready(to, POLLOUT, Clock::now() + seconds(0.02))) continue;
        const ssize_t n = send(to, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n < 0 && errno != EAGAIN) return;
        if (n > 0) done += static_cast<std::size_t>(n);
      }
      waiting -= bytes.size();
      packets.pop_front();
    }
    // Full: the sender's own buffers fill up now.
    const bool full =
        waiting > network_.queue + on_the_wire ||
        wire_free > now + seconds(static_cast<double>(network_.queue) / network_.bytes_per_second);
    const auto next = packets.empty() ? now + seconds(0.02) : packets.front().arrives;
    if (full) {
      std::this_thread::sleep_until(std::min(next, now + seconds(0.001)));
      continue;
    }
    if (!ready(from, POLLIN, next)) continue;
    Packet packet{.arrives = {}, .bytes = std::vector<char>(network_.packet)};
    const ssize_t n = recv(from, packet.bytes.data(), packet.bytes.size(), MSG_DONTWAIT);
    if (n == 0) {
      shutdown(to, SHUT_WR);
      return;
    }
    if (n < 0) continue;
    packet.bytes.resize(static_cast<std::size_t>(n));
    wire_free =
        std::max(wire_free, Clock::now()) + seconds(static_cast<double>(n) / network_.bytes_per_second);
    auto arrives = wire_free + seconds(network_.delay_seconds);
    // Again after a round trip, until it is not lost.
    while (std::uniform_real_distribution<>()(random) < network_.loss)
      arrives += seconds(2 * network_.delay_seconds);
    // In order: what is behind a lost packet waits for it.
    last_arrival = packet.arrives = std::max(arrives, last_arrival);
    waiting += packet.bytes.size();
    packets.push_back(std::move(packet));
  }
}

}  // namespace ecorche::server
