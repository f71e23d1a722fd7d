// SPDX-License-Identifier: Apache-2.0
// Where a server may be reached, and that it is.
#pragma once

#include "runtime/server/net/asio.hpp"
#include "runtime/server/resources/options.hpp"

namespace ecorche::server {

/// The address of `where`. Throws Error{usage} for none, and Error{refused} for one that others reach where
/// nothing keeps them out: neither TLS with a token nor `options.insecure`.
tcp::endpoint endpoint_of(const Endpoint& where, const Options& options);

/// Throws Error{temporary} where the address is in use, Error{usage} where this machine or its user has none
/// such.
void start_listening(tcp::acceptor& acceptor, const tcp::endpoint& endpoint);

}  // namespace ecorche::server
