// SPDX-License-Identifier: Apache-2.0
#include <ecorche/client/socket.hpp>

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
#include <system_error>
#include <utility>

namespace ecorche::client {
namespace {

// Fewer bytes than this are not worth changing what a wait is for.
constexpr std::size_t kMany = 64U << 10;

std::string reason(int error) {
  return std::generic_category().message(error);
}

}  // namespace

Socket::Socket(const wire::Address& address, Clock::time_point until, const std::string& authorities)
    : where_(address.host + ":" + std::to_string(address.port)) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  if (const int error =
          getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &list);
      error != 0) {
    fail(gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(list, freeaddrinfo);
  int error = EADDRNOTAVAIL;
  for (const addrinfo* a = list; a && error != 0; a = a->ai_next) {
    if (fd_ >= 0) close(fd_);
    fd_ = socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    if (fd_ < 0) {
      error = errno;
      continue;
    }
    error = connect(fd_, a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
    if (error != EINPROGRESS) continue;
    error = ETIMEDOUT;
    socklen_t size = sizeof error;
    if (wait(POLLOUT, until)) getsockopt(fd_, SOL_SOCKET, SO_ERROR, &error, &size);
  }
  if (error != 0) {
    if (fd_ >= 0) close(fd_);
    fail("cannot be reached: " + reason(error));
  }
  const int on = 1;
  setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (authorities.empty()) return;
  try {
    tls_ = std::make_unique<Tls>(authorities, address.host);
    tls_->handshake([&](std::span<std::byte> out) { return read_plain(out, until); },
                    [&](std::span<const std::byte> bytes) { write_plain(bytes, until); });
  } catch (...) {
    close(fd_);
    throw;
  }
}

Socket::~Socket() {
  close(fd_);
}

std::size_t Socket::read(std::span<std::byte> out, Clock::time_point until, std::size_t enough) {
  if (!tls_) return read_plain(out, until, enough);
  return tls_->read(
      out, [&](std::span<std::byte> plain) { return read_plain(plain, until); },
      [&](std::span<const std::byte> bytes) { write_plain(bytes, until); });
}

void Socket::write(std::span<const std::byte> bytes, Clock::time_point until) {
  if (!tls_) return write_plain(bytes, until);
  tls_->write(bytes, [&](std::span<const std::byte> part) { write_plain(part, until); });
}

std::size_t Socket::read_plain(std::span<std::byte> out, Clock::time_point until, std::size_t enough) {
  bool late = false;
  while (true) {
    const ssize_t n = recv(fd_, out.data(), out.size(), 0);
    if (n > 0) return static_cast<std::size_t>(n);
    if (n == 0) fail("the server hung up");
    if (errno != EAGAIN && errno != EINTR) fail(reason(errno));
    if (late) return 0;
    wake_at(enough < kMany ? 1 : enough);
    late = !wait(POLLIN, until);  // fewer than that may be there
  }
}

void Socket::wake_at(std::size_t bytes) {
  if (std::exchange(wakes_at_, bytes) == bytes) return;
  const int least = static_cast<int>(bytes);
  // Where it cannot be set, waits end sooner, that is all.
  static_cast<void>(setsockopt(fd_, SOL_SOCKET, SO_RCVLOWAT, &least, sizeof least));
}

void Socket::write_plain(std::span<const std::byte> bytes, Clock::time_point until) {
  while (!bytes.empty()) {
    const ssize_t n = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(n));
      continue;
    }
    if (errno != EAGAIN && errno != EINTR) fail(reason(errno));
    if (!wait(POLLOUT, until)) fail("the server stopped reading");
  }
}

bool Socket::wait(short events, Clock::time_point until) const {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
  pollfd poll_fd{.fd = fd_, .events = events, .revents = 0};
  constexpr std::int64_t longest = std::numeric_limits<int>::max();
  const int ready = poll(&poll_fd, 1, static_cast<int>(std::clamp<std::int64_t>(left, 0, longest)));
  // An interrupted wait is over early, like a ready one: the caller tries and comes back.
  return ready > 0 || (ready < 0 && errno == EINTR);
}

void Socket::fail(const std::string& what) const {
  throw Error(ErrorKind::temporary, where_, what, "start the server there, or try again");
}

}  // namespace ecorche::client
