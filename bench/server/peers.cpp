// SPDX-License-Identifier: Apache-2.0
#include "bench/server/peers.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <ecorche/wire/framing.hpp>

namespace ecorche::bench {
namespace {

int connected(const wire::Address& address) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(address.port);
  inet_pton(AF_INET, address.host.c_str(), &to.sin_addr);
  if (fd < 0 || connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    std::fprintf(stderr, "bench: cannot connect (raise the limit of open files)\n");
    std::exit(1);
  }
  fcntl(fd, F_SETFL, O_NONBLOCK);
  return fd;
}

// Hello, the body, a subscription to all of it as float32, and a pose: more than any socket buffer holds,
// twice.
std::string asks_for_much() {
  std::string bytes;
  const auto say = [&](const v1::Envelope& envelope) { bytes += wire::encode(envelope).head; };
  v1::Envelope hello, open, subscribe;
  hello.set_request_id(1);
  hello.mutable_client_hello()->set_protocol_min(1);
  hello.mutable_client_hello()->set_protocol_max(1);
  say(hello);
  open.set_request_id(2);
  open.mutable_open_model();
  say(open);
  for (std::uint64_t i = 0; i < 2; ++i) {
    subscribe.set_request_id(3 + i);
    subscribe.mutable_subscribe()->mutable_mesh()->set_quality(i == 1);
    say(subscribe);
  }
  return bytes;
}

}  // namespace

Peers::Peers(const wire::Address& address, int count, Manner manner)
    : manner_(manner), alive_(static_cast<std::size_t>(count)) {
  thread_ = std::thread([this, address, count] {
    come(address, count);
    run();
  });
}

// Not on the thread of those who are served: what they wait for meanwhile would be counted as the server's.
void Peers::come(const wire::Address& address, int count) {
  const std::string much = asks_for_much();
  for (int i = 0; i < count; ++i) {
    born_.push_back(std::chrono::steady_clock::now());
    sockets_.push_back(connected(address));
    if (manner_ != Manner::stop_reading) continue;
    if (send(sockets_.back(), much.data(), much.size(), MSG_NOSIGNAL) < 0) {
      std::fprintf(stderr, "bench: cannot send (see the server)\n");
      std::exit(1);
    }
  }
}

Peers::~Peers() {
  stop_ = true;
  thread_.join();
  for (const int fd : sockets_) {
    if (fd >= 0) close(fd);
  }
}

void Peers::run() {
  const char byte = 1;
  auto next_drip = std::chrono::steady_clock::now();
  std::vector<pollfd> watched;
  while (!stop_ && alive_ > 0) {
    const bool drip = manner_ == Manner::drip && std::chrono::steady_clock::now() >= next_drip;
    if (drip) next_drip += std::chrono::seconds(1);
    for (std::size_t i = 0; i < sockets_.size(); ++i) {
      int& fd = sockets_[i];
      if (fd < 0) continue;
      char seen[4096];
      bool gone = drip && send(fd, &byte, 1, MSG_NOSIGNAL) < 0 && errno != EAGAIN;
      // Whoever does not read looks for a reset only.
      if (manner_ == Manner::stop_reading) {
        int error = 0;
        socklen_t size = sizeof error;
        getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
        const ssize_t n = send(fd, &byte, 0, MSG_NOSIGNAL);
        gone = error != 0 || (n < 0 && errno != EAGAIN);
        if (!gone) {
          // A pong that nobody asked for: the server's reset answers it.
          static const std::string pong = [] {
            v1::Envelope envelope;
            envelope.mutable_pong();
            return wire::encode(envelope).head;
          }();
          gone = send(fd, pong.data(), pong.size(), MSG_NOSIGNAL) < 0 && errno != EAGAIN;
        }
      } else {
        ssize_t n = 1;
        while (n > 0) n = recv(fd, seen, sizeof seen, 0);
        gone = gone || n == 0 || (errno != EAGAIN && errno != EINTR);
      }
      if (!gone) continue;
      close(fd);
      fd = -1;
      const auto lived = std::chrono::steady_clock::now() - born_[i];
      longest_ = std::max(longest_.load(), std::chrono::duration<double>(lived).count());
      --alive_;
    }
    if (manner_ == Manner::stop_reading) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      continue;
    }
    // Until one hears something, most likely the end.
    watched.clear();
    for (const int fd : sockets_) {
      if (fd >= 0) watched.push_back({.fd = fd, .events = POLLIN, .revents = 0});
    }
    poll(watched.data(), watched.size(), 100);
  }
}

std::unique_ptr<Peers> stalled_readers(const wire::Address& address, int count) {
  return std::make_unique<Peers>(address, count, Peers::Manner::stop_reading);
}

std::unique_ptr<Peers> idle_connections(const wire::Address& address, int count) {
  return std::make_unique<Peers>(address, count, Peers::Manner::idle);
}

std::unique_ptr<Peers> dripping_connections(const wire::Address& address, int count) {
  return std::make_unique<Peers>(address, count, Peers::Manner::drip);
}

}  // namespace ecorche::bench
