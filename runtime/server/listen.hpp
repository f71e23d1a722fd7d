// SPDX-License-Identifier: Apache-2.0
// Where a server may be reached, and that it is.
#pragma once

#include <cstdint>
#include <optional>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/resources/options.hpp"

namespace ecorche::server {

/// Throws Error{usage} for half of TLS, Error{config} for a token that is too short.
void check_options(const Options& options);

/// The address of `where`. Throws Error{usage} for none, and Error{refused} for one that others reach where
/// nothing keeps them out: neither TLS with a token nor `options.insecure`.
tcp::endpoint endpoint_of(const Endpoint& where, const Options& options);

/// By the socket `passed`, where there is one. Else, where the port is in use, at one of `more_ports` after
/// it. Throws Error{temporary} where all are in use, Error{usage} where this machine or its user has no such
/// address.
void start_listening(tcp::acceptor& acceptor, const tcp::endpoint& endpoint,
                     const std::optional<std::intptr_t>& passed = {}, std::uint16_t more_ports = 0);

}  // namespace ecorche::server
