// SPDX-License-Identifier: Apache-2.0
// A TCP connection that waits no longer than it is told.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <system_error>

#include "core/platform/socket_options.hpp"

namespace ecorche::platform {

/// Errors of looking up a host's address.
const std::error_category& lookup_category();

/// Not for two threads at once.
class TcpClient {
 public:
  using Clock = std::chrono::steady_clock;

  /// Connects to the first address of `host` that answers until `until`, each in turn. Without delays of
  /// small writes.
  TcpClient(const std::string& host, std::uint16_t port, Clock::time_point until, std::error_code& error);
  ~TcpClient();
  TcpClient(const TcpClient&) = delete;
  TcpClient& operator=(const TcpClient&) = delete;

  /// Reads what is there, at least a byte; 0 when none came until `until`, and when the peer has closed its
  /// end. Where nothing is there it sleeps until `enough` bytes have come, or `until`.
  std::size_t read(std::span<std::byte> out, Clock::time_point until, std::size_t enough,
                   std::error_code& error);
  /// For who waits for several at once. -1 where there is none.
  std::intptr_t handle() const { return socket_; }
  /// Whether a read has met the end of what the peer sends.
  bool ended() const { return ended_; }
  /// Writes all, or as much as the peer takes until `until`; the number of bytes.
  std::size_t write(std::span<const std::byte> bytes, Clock::time_point until, std::error_code& error);

 private:
  void wake_at(std::size_t bytes);

  SocketHandle socket_ = -1;
  std::size_t wakes_at_ =
      1;  ///< bytes that must have come before a wait for them ends, where the system has it
  bool ended_ = false;
};

}  // namespace ecorche::platform
