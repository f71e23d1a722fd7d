// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <stop_token>

namespace ecorche::app {

/// A token that SIGINT and SIGTERM set; a second signal ends the process at once. Call once. Both get a
/// handler, whatever thread they reach: libraries start threads while they are loaded (OpenBLAS), in which
/// blocked signals would not be. A signal that the process was told to ignore stays ignored.
std::stop_token stop_on_signals();

/// As long as one lives, SIGHUP from another process calls it, on a thread of its own; before the first, it
/// ends the process. Where the kernel sends it, since the terminal is gone, it is as SIGTERM.
class OnHangup {
 public:
  explicit OnHangup(std::function<void()> call);
  ~OnHangup();
  OnHangup(const OnHangup&) = delete;
  OnHangup& operator=(const OnHangup&) = delete;
};

}  // namespace ecorche::app
