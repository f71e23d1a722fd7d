// SPDX-License-Identifier: Apache-2.0
// TLS over whatever moves bytes.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace ecorche::client {

/// One side of a TLS connection, without a socket of its own: `receive` reads at least a byte, or returns 0
/// when none came in time; `send` writes all.
class Tls {
 public:
  /// Reads bytes of the connection below; 0 when none came in time.
  using Receive = std::function<std::size_t(std::span<std::byte>)>;
  /// Writes bytes to the connection below.
  using Send = std::function<void(std::span<const std::byte>)>;

  /// Trusts the certificates in `authorities` (PEM) only, for this host (a name or a numeric address). Throws
  /// Error{config} where the file holds none.
  Tls(const std::string& authorities, std::string host);
  ~Tls();

  /// Throws Error{refused} for a server that is not trusted, Error{protocol} for one that speaks no TLS,
  /// Error{temporary} when nothing came in time.
  void handshake(const Receive& receive, const Send& send);
  /// At least a byte; 0 when none came in time. Throws Error{temporary} at the end.
  std::size_t read(std::span<std::byte> out, const Receive& receive, const Send& send);
  /// Encrypts and sends all of it.
  void write(std::span<const std::byte> bytes, const Send& send);

 private:
  void flush(const Send& send);
  bool fill(const Receive& receive);
  [[noreturn]] void fail(int result);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ecorche::client
