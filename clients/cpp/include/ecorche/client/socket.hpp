// SPDX-License-Identifier: Apache-2.0
// A TCP socket, or TLS over one, that waits no longer than it is told.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include <ecorche/client/tls.hpp>
#include <ecorche/wire/address.hpp>

namespace ecorche::platform {
class TcpClient;
}

namespace ecorche::client {

using Clock = std::chrono::steady_clock;

/// Not for two threads at once.
class Socket {
 public:
  /// Throws Error{temporary} when nobody answers there until `until`. `authorities`: a PEM file; empty: no
  /// TLS. What else a server can do wrong there: Tls.
  Socket(const wire::Address& address, Clock::time_point until, const std::string& authorities = {});
  ~Socket();
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  /// Reads what is there, at least a byte; 0 when none came until `until`. Where nothing is there it sleeps
  /// until `enough` bytes have come, if they are many: waking for each segment of a large frame would take
  /// longer than copying it. Throws Error{temporary} when the peer hung up.
  std::size_t read(std::span<std::byte> out, Clock::time_point until, std::size_t enough = 1);
  /// Writes all. Throws Error{temporary} when the peer hung up, or did not take it until `until`.
  void write(std::span<const std::byte> bytes, Clock::time_point until);
  /// The system's handle, for who waits for several at once.
  std::intptr_t handle() const;

 private:
  std::size_t read_plain(std::span<std::byte> out, Clock::time_point until, std::size_t enough = 1);
  void write_plain(std::span<const std::byte> bytes, Clock::time_point until);
  [[noreturn]] void fail(const std::string& what) const;

  std::string where_;
  std::unique_ptr<platform::TcpClient> plain_;
  std::unique_ptr<Tls> tls_;
};

}  // namespace ecorche::client
