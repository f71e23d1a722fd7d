// SPDX-License-Identifier: Apache-2.0
// TLS by OpenSSL, and the proofs of the right to connect.
#pragma once

#include <memory>
#include <string>

#include "runtime/server/net/transport.hpp"

namespace ecorche::server {

/// Turns sockets into transports: plain ones without a certificate.
class Carrier {
 public:
  /// PEM files: a certificate chain and its key. Empty: no encryption. TLS 1.2 or newer. Throws Error{config}
  /// for files that cannot be read or do not belong together.
  Carrier(const std::string& certificate, const std::string& key);
  ~Carrier();

  std::unique_ptr<Transport> carry(tcp::socket socket) const;

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

/// 16 random bytes that nobody can guess, in hexadecimal.
std::string random_token();

}  // namespace ecorche::server
