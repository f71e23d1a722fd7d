// SPDX-License-Identifier: Apache-2.0
// What a service manager hands to a service that it starts, and is told by it: the protocols of
// sd_listen_fds(3) and sd_notify(3). They are three environment variables and a datagram, and systemd
// promises that they stay; its library would be one more to build and run with, on systems that have no
// systemd, too.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "core/platform/socket_options.hpp"

namespace ecorche::platform {

/// A TCP socket that listens already.
struct PassedSocket {
  SocketHandle handle = -1;
  std::string name;  ///< as the service manager calls it; empty where it does not
  std::string host;  ///< numeric
  std::uint16_t port = 0;
};

/// The sockets that were passed to this process, in their order; none where none was, and where they were
/// passed to another one. Children do not inherit them. Throws Error{config} for what cannot be understood,
/// and for a socket that is not TCP or does not listen.
std::vector<PassedSocket> passed_sockets();

/// Tells lines such as `READY=1` to the service manager; without one, or where it did not ask, nothing
/// happens.
std::error_code tell_service_manager(std::string_view lines);

/// `RELOADING=1` as service managers want it: with the time at which it began.
std::string reloading_since_now();

}  // namespace ecorche::platform
