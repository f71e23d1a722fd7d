// SPDX-License-Identifier: Apache-2.0
// As ../tcp_client.cpp, by Winsock: all that libecorche_client asks of a system.
#include "core/platform/tcp_client.hpp"

#include <winsock2.h>
#include <ws2tcpip.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>

namespace ecorche::platform {
namespace {

using Clock = TcpClient::Clock;

// Once a process, and for as long as it lives: who embeds us may use Winsock as well.
int start_winsock() {
  static const int error = [] {
    WSADATA data{};
    return WSAStartup(MAKEWORD(2, 2), &data);
  }();
  return error;
}

class LookupCategory final : public std::error_category {
 public:
  const char* name() const noexcept override { return "lookup"; }
  // Winsock's errors of looking up are the system's.
  std::string message(int error) const override { return std::system_category().message(error); }
};

std::error_code of(int error) {
  return {error, std::system_category()};
}

SOCKET handle_of(SocketHandle socket) {
  return static_cast<SOCKET>(socket);
}

int length_of(std::size_t bytes) {
  return static_cast<int>(std::min<std::size_t>(bytes, std::numeric_limits<int>::max()));
}

enum class For : std::uint8_t { reading, writing };

// Whether it came to that, or failed, in time. By select(): WSAPoll() did not tell of refused connections
// before 2020.
bool wait(SOCKET socket, For what, Clock::time_point until) {
  const auto left =
      std::max<std::int64_t>(0, std::chrono::ceil<std::chrono::microseconds>(until - Clock::now()).count());
  constexpr std::int64_t second = 1'000'000, longest = 1'000'000'000;
  timeval time{.tv_sec = static_cast<long>(std::min(left / second, longest)),
               .tv_usec = static_cast<long>(left % second)};
  fd_set ready, failed;
  FD_ZERO(&ready);
  FD_ZERO(&failed);
  FD_SET(socket, &ready);
  FD_SET(socket, &failed);
  const bool reads = what == For::reading;
  return select(0, reads ? &ready : nullptr, reads ? nullptr : &ready, &failed, &time) > 0;
}

// 0, or why there is no connection to this address.
int connect_until(SOCKET socket, const addrinfo& to, Clock::time_point until) {
  u_long on = 1;
  if (ioctlsocket(socket, static_cast<long>(FIONBIO), &on) != 0) return WSAGetLastError();
  if (connect(socket, to.ai_addr, static_cast<int>(to.ai_addrlen)) == 0) return 0;
  if (const int error = WSAGetLastError(); error != WSAEWOULDBLOCK) return error;
  if (!wait(socket, For::writing, until)) return WSAETIMEDOUT;
  int error = WSAETIMEDOUT, size = sizeof error;
  getsockopt(socket, SOL_SOCKET, SO_ERROR, reinterpret_cast<char*>(&error), &size);
  return error;
}

}  // namespace

const std::error_category& lookup_category() {
  static const LookupCategory category;
  return category;
}

TcpClient::TcpClient(const std::string& host, std::uint16_t port, Clock::time_point until,
                     std::error_code& problem) {
  if (const int error = start_winsock(); error != 0) {
    problem = of(error);
    return;
  }
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  if (const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &list); error != 0) {
    problem = {error, lookup_category()};
    return;
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(list, freeaddrinfo);
  int error = WSAEADDRNOTAVAIL;
  for (const addrinfo* a = list; a != nullptr && error != 0; a = a->ai_next) {
    if (socket_ >= 0) closesocket(handle_of(socket_));
    // Children do not inherit it.
    const SOCKET made = WSASocketW(a->ai_family, a->ai_socktype, a->ai_protocol, nullptr, 0,
                                   WSA_FLAG_OVERLAPPED | WSA_FLAG_NO_HANDLE_INHERIT);
    socket_ = static_cast<SocketHandle>(made);
    error = made == INVALID_SOCKET ? WSAGetLastError() : connect_until(made, *a, until);
  }
  problem = of(error);
  if (problem) return;
  const int on = 1;
  setsockopt(handle_of(socket_), IPPROTO_TCP, TCP_NODELAY, reinterpret_cast<const char*>(&on), sizeof on);
}

TcpClient::~TcpClient() {
  if (socket_ >= 0) closesocket(handle_of(socket_));
}

// Windows wakes a waiting reader at the first byte, whatever `enough` is.
std::size_t TcpClient::read(std::span<std::byte> out, Clock::time_point until, std::size_t,
                            std::error_code& error) {
  error = {};
  bool late = false;
  while (true) {
    const int n = recv(handle_of(socket_), reinterpret_cast<char*>(out.data()), length_of(out.size()), 0);
    if (n > 0) return static_cast<std::size_t>(n);
    ended_ = n == 0;
    if (ended_) return 0;
    if (const int wrong = WSAGetLastError(); wrong != WSAEWOULDBLOCK) {
      error = of(wrong);
      return 0;
    }
    if (late) return 0;
    late = !wait(handle_of(socket_), For::reading, until);
  }
}

std::size_t TcpClient::write(std::span<const std::byte> bytes, Clock::time_point until,
                             std::error_code& error) {
  error = {};
  std::size_t written = 0;
  while (written < bytes.size()) {
    const int n = send(handle_of(socket_), reinterpret_cast<const char*>(bytes.data()) + written,
                       length_of(bytes.size() - written), 0);
    if (n > 0) {
      written += static_cast<std::size_t>(n);
      continue;
    }
    if (const int wrong = WSAGetLastError(); wrong != WSAEWOULDBLOCK) {
      error = of(wrong);
      break;
    }
    if (!wait(handle_of(socket_), For::writing, until)) break;
  }
  return written;
}

}  // namespace ecorche::platform
