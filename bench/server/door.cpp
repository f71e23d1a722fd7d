// SPDX-License-Identifier: Apache-2.0
#include "bench/server/door.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include <ecorche/values/error.hpp>

namespace ecorche::bench {
namespace {

// In a child of a program with threads: nothing but calls of the kernel.
[[noreturn]] void keep(int door, std::size_t bytes) {
  static constexpr std::array<char, 1 << 16> zeros{};
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  while (true) {
    const int guest = accept4(door, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (guest < 0) continue;
    for (std::size_t left = bytes; left > 0;) {
      const ssize_t n = send(guest, zeros.data(), std::min(left, zeros.size()), MSG_NOSIGNAL);
      if (n <= 0) break;  // it is full
      left -= static_cast<std::size_t>(n);
    }
  }
}

}  // namespace

Door::Door(std::size_t bytes) {
  const int door = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof here;
  if (bind(door, reinterpret_cast<sockaddr*>(&here), sizeof here) != 0 || listen(door, SOMAXCONN) != 0 ||
      getsockname(door, reinterpret_cast<sockaddr*>(&here), &size) != 0)
    throw Error(ErrorKind::temporary, "bench", "no loopback", "run it again");
  address_.host = "127.0.0.1";
  address_.port = ntohs(here.sin_port);
  child_ = fork();
  if (child_ == 0) keep(door, bytes);
  close(door);
}

Door::~Door() {
  if (child_ <= 0) return;
  kill(child_, SIGKILL);
  waitpid(child_, nullptr, 0);
}

}  // namespace ecorche::bench
