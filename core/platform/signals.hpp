// SPDX-License-Identifier: Apache-2.0
// What the system tells a process: to stop, to reopen or read again what it keeps.
#pragma once

#include <cstdint>

namespace ecorche::platform {

enum class Signal : std::uint8_t { stop, hangup };

/// From now on SIGINT and SIGTERM are told by wait_for_signal() instead of ending the process, whatever
/// thread they reach; one that the process was told to ignore stays ignored. False where that cannot be: they
/// then end the process. To be called once.
bool catch_stops();

/// From now on SIGHUP from another process is told as Signal::hangup; from the kernel, since the terminal is
/// gone, as Signal::stop. Does nothing before catch_stops().
void catch_hangups();

/// Waits for the next one. False where there will be none.
bool wait_for_signal(Signal& which);

/// Ends the process at once: nothing is destroyed or flushed.
[[noreturn]] void end_process(int code);

}  // namespace ecorche::platform
