// SPDX-License-Identifier: Apache-2.0
#include "core/platform/socket_options.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <string_view>

namespace ecorche::platform {

void limit_unsent([[maybe_unused]] SocketHandle socket, [[maybe_unused]] int bytes) {
#ifdef TCP_NOTSENT_LOWAT
  static_cast<void>(
      setsockopt(static_cast<int>(socket), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &bytes, sizeof bytes));
#endif
}

void prefer_bbr([[maybe_unused]] SocketHandle socket) {
#ifdef TCP_CONGESTION
  constexpr std::string_view kBbr = "bbr";
  static_cast<void>(setsockopt(static_cast<int>(socket), IPPROTO_TCP, TCP_CONGESTION, kBbr.data(),
                               static_cast<socklen_t>(kBbr.size())));
#endif
}

bool has_hung_up([[maybe_unused]] SocketHandle socket) {
#ifdef POLLRDHUP
  pollfd asked{.fd = static_cast<int>(socket), .events = POLLRDHUP, .revents = 0};
  return ::poll(&asked, 1, 0) > 0;
#else
  return false;
#endif
}

std::chrono::milliseconds since_received([[maybe_unused]] SocketHandle socket) {
#ifdef __linux__
  tcp_info info{};
  socklen_t size = sizeof info;
  if (getsockopt(static_cast<int>(socket), IPPROTO_TCP, TCP_INFO, &info, &size) == 0)
    return std::chrono::milliseconds(info.tcpi_last_data_recv);
#endif
  return {};
}

}  // namespace ecorche::platform
