// SPDX-License-Identifier: Apache-2.0
#include "core/platform/service.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <optional>

#include <ecorche/values/error.hpp>

namespace ecorche::platform {
namespace {

constexpr int kFirstPassed = 3;   // SD_LISTEN_FDS_START
constexpr int kMostPassed = 256;  // nobody has so many ports

// Of an environment that no thread writes.
std::string_view variable(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? std::string_view() : std::string_view(text);
}

std::optional<int> number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Error unusable(int handle, const std::string& what) {
  return {ErrorKind::config, "LISTEN_FDS", "socket " + std::to_string(handle) + " " + what,
          "pass sockets that listen on TCP (ListenStream=HOST:PORT), or none"};
}

bool listens_on_tcp(int handle) {
  int type = 0, listens = 0;
  socklen_t size = sizeof type;
  if (getsockopt(handle, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_STREAM) return false;
  size = sizeof listens;
  return getsockopt(handle, SOL_SOCKET, SO_ACCEPTCONN, &listens, &size) == 0 && listens != 0;
}

PassedSocket describe(int handle, std::string_view name) {
  if (fcntl(handle, F_GETFD) < 0) throw unusable(handle, "was promised, and is not there");
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getsockname(handle, reinterpret_cast<sockaddr*>(&address), &size) != 0 || !listens_on_tcp(handle))
    throw unusable(handle, "does not listen");
  PassedSocket out{.handle = handle, .name = std::string(name), .host = {}, .port = 0};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address.ss_family == AF_INET) {
    const auto* v4 = reinterpret_cast<const sockaddr_in*>(&address);
    inet_ntop(AF_INET, &v4->sin_addr, text.data(), text.size());
    out.port = ntohs(v4->sin_port);
  } else if (address.ss_family == AF_INET6) {
    const auto* v6 = reinterpret_cast<const sockaddr_in6*>(&address);
    inet_ntop(AF_INET6, &v6->sin6_addr, text.data(), text.size());
    out.port = ntohs(v6->sin6_port);
  } else {
    throw unusable(handle, "is not of TCP");
  }
  out.host = text.data();
  fcntl(handle, F_SETFD, FD_CLOEXEC);
  return out;
}

// The part of `names` up to the first colon, which is taken off.
std::string_view next_name(std::string_view& names) {
  const std::string_view name = names.substr(0, names.find(':'));
  names.remove_prefix(std::min(names.size(), name.size() + 1));
  return name;
}

}  // namespace

std::vector<PassedSocket> passed_sockets() {
  const std::string_view count = variable("LISTEN_FDS");
  if (count.empty() || number(variable("LISTEN_PID")) != static_cast<int>(getpid())) return {};
  const std::optional<int> sockets = number(count);
  if (!sockets || *sockets < 0 || *sockets > kMostPassed)
    throw Error(ErrorKind::config, "LISTEN_FDS", "'" + std::string(count) + "' is no number of sockets",
                "let the service manager set it, or nobody");
  std::string_view names = variable("LISTEN_FDNAMES");
  std::vector<PassedSocket> out;
  out.reserve(static_cast<std::size_t>(*sockets));
  for (int i = 0; i < *sockets; ++i) out.push_back(describe(kFirstPassed + i, next_name(names)));
  return out;
}

std::error_code tell_service_manager(std::string_view lines) {
  const std::string_view where = variable("NOTIFY_SOCKET");
  if (where.empty()) return {};
  sockaddr_un address{};
  if ((where[0] != '/' && where[0] != '@') || where.size() >= sizeof address.sun_path)
    return std::make_error_code(std::errc::address_family_not_supported);
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, where.data(), where.size());
  if (where[0] == '@') address.sun_path[0] = '\0';  // in no folder
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + where.size());
  const int handle = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (handle < 0) return {errno, std::system_category()};
  ssize_t sent = 0;
  do {
    sent = sendto(handle, lines.data(), lines.size(), MSG_NOSIGNAL,
                  reinterpret_cast<const sockaddr*>(&address), size);
  } while (sent < 0 && errno == EINTR);
  const std::error_code error = sent < 0 ? std::error_code(errno, std::system_category()) : std::error_code();
  close(handle);
  return error;
}

std::string reloading_since_now() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const auto microseconds = std::uint64_t{1'000'000} * static_cast<std::uint64_t>(now.tv_sec) +
                            static_cast<std::uint64_t>(now.tv_nsec) / 1000;
  return "RELOADING=1\nMONOTONIC_USEC=" + std::to_string(microseconds);
}

}  // namespace ecorche::platform
