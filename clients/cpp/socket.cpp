// SPDX-License-Identifier: Apache-2.0
#include <ecorche/client/socket.hpp>

#include <system_error>

#include "core/platform/tcp_client.hpp"

namespace ecorche::client {
namespace {

// Fewer bytes than this are not worth changing what a wait is for.
constexpr std::size_t kMany = 64U << 10;

}  // namespace

Socket::Socket(const wire::Address& address, Clock::time_point until, const std::string& authorities)
    : where_(address.host + ":" + std::to_string(address.port)) {
  std::error_code error;
  plain_ = std::make_unique<platform::TcpClient>(address.host, address.port, until, error);
  if (error) {
    const bool known = error.category() != platform::lookup_category();
    fail((known ? "cannot be reached: " : "") + error.message());
  }
  if (authorities.empty()) return;
  tls_ = std::make_unique<Tls>(authorities, address.host);
  tls_->handshake([&](std::span<std::byte> out) { return read_plain(out, until); },
                  [&](std::span<const std::byte> bytes) { write_plain(bytes, until); });
}

Socket::~Socket() = default;

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

std::intptr_t Socket::handle() const {
  return plain_->handle();
}

std::size_t Socket::read_plain(std::span<std::byte> out, Clock::time_point until, std::size_t enough) {
  std::error_code error;
  const std::size_t read = plain_->read(out, until, enough < kMany ? 1 : enough, error);
  if (plain_->ended()) fail("the server hung up");
  if (error) fail(error.message());
  return read;
}

void Socket::write_plain(std::span<const std::byte> bytes, Clock::time_point until) {
  std::error_code error;
  const std::size_t written = plain_->write(bytes, until, error);
  if (error) fail(error.message());
  if (written < bytes.size()) fail("the server stopped reading");
}

void Socket::fail(const std::string& what) const {
  throw Error(ErrorKind::temporary, where_, what, "start the server there, or try again");
}

}  // namespace ecorche::client
