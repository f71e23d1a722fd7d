// SPDX-License-Identifier: Apache-2.0
// What a network library does not offer of a connected TCP socket. Where the system has none of it either,
// nothing changes and nothing is told.
#pragma once

#include <chrono>
#include <cstdint>

namespace ecorche::platform {

/// Of whatever library has opened it.
using SocketHandle = std::intptr_t;

/// The system keeps at most so many bytes that have not been sent.
void limit_unsent(SocketHandle socket, int bytes);

/// Congestion is told by BBR, where the system has it and lets this process have it.
void prefer_bbr(SocketHandle socket);

/// Whether the peer has closed its end; what it sent before may still wait to be read.
bool has_hung_up(SocketHandle socket);

/// How long ago the last bytes came; 0 where the system does not tell.
std::chrono::milliseconds since_received(SocketHandle socket);

}  // namespace ecorche::platform
