// SPDX-License-Identifier: Apache-2.0
#include "core/platform/tcp_client.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <memory>
#include <utility>

namespace ecorche::platform {
namespace {

using Clock = TcpClient::Clock;

class LookupCategory final : public std::error_category {
 public:
  const char* name() const noexcept override { return "lookup"; }
  std::string message(int error) const override { return gai_strerror(error); }
};

int descriptor_of(SocketHandle socket) {
  return static_cast<int>(socket);
}

std::error_code of(int error) {
  return {error, std::generic_category()};
}

bool wait(SocketHandle socket, short events, Clock::time_point until) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
  pollfd poll_fd{.fd = descriptor_of(socket), .events = events, .revents = 0};
  constexpr std::int64_t longest = std::numeric_limits<int>::max();
  const int ready = poll(&poll_fd, 1, static_cast<int>(std::clamp<std::int64_t>(left, 0, longest)));
  // An interrupted wait is over early, like a ready one: the caller tries and comes back.
  return ready > 0 || (ready < 0 && errno == EINTR);
}

}  // namespace

const std::error_category& lookup_category() {
  static const LookupCategory category;
  return category;
}

TcpClient::TcpClient(const std::string& host, std::uint16_t port, Clock::time_point until,
                     std::error_code& problem) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  if (const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &list); error != 0) {
    problem = {error, lookup_category()};
    return;
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(list, freeaddrinfo);
  int error = EADDRNOTAVAIL;
  for (const addrinfo* a = list; a && error != 0; a = a->ai_next) {
    if (socket_ >= 0) close(descriptor_of(socket_));
    socket_ = socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    if (socket_ < 0) {
      error = errno;
      continue;
    }
    error = connect(descriptor_of(socket_), a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
    if (error != EINPROGRESS) continue;
    error = ETIMEDOUT;
    socklen_t size = sizeof error;
    if (wait(socket_, POLLOUT, until))
      getsockopt(descriptor_of(socket_), SOL_SOCKET, SO_ERROR, &error, &size);
  }
  problem = of(error);
  if (problem) return;
  const int on = 1;
  setsockopt(descriptor_of(socket_), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

TcpClient::~TcpClient() {
  if (socket_ >= 0) close(descriptor_of(socket_));
}

std::size_t TcpClient::read(std::span<std::byte> out, Clock::time_point until, std::size_t enough,
                            std::error_code& error) {
  error = {};
  bool late = false;
  while (true) {
    const ssize_t n = recv(descriptor_of(socket_), out.data(), out.size(), 0);
    if (n > 0) return static_cast<std::size_t>(n);
    ended_ = n == 0;
    if (ended_) return 0;
    if (errno != EAGAIN && errno != EINTR) {
      error = of(errno);
      return 0;
    }
    if (late) return 0;
    wake_at(enough);
    late = !wait(socket_, POLLIN, until);  // fewer than that may be there
  }
}

void TcpClient::wake_at(std::size_t bytes) {
  if (std::exchange(wakes_at_, bytes) == bytes) return;
  const int least = static_cast<int>(bytes);
  // Where it cannot be set, waits end sooner, that is all.
  static_cast<void>(setsockopt(descriptor_of(socket_), SOL_SOCKET, SO_RCVLOWAT, &least, sizeof least));
}

std::size_t TcpClient::write(std::span<const std::byte> bytes, Clock::time_point until,
                             std::error_code& error) {
  error = {};
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t n =
        send(descriptor_of(socket_), bytes.data() + written, bytes.size() - written, MSG_NOSIGNAL);
    if (n > 0) {
      written += static_cast<std::size_t>(n);
      continue;
    }
    if (errno != EAGAIN && errno != EINTR) {
      error = of(errno);
      break;
    }
    if (!wait(socket_, POLLOUT, until)) break;
  }
  return written;
}

}  // namespace ecorche::platform
