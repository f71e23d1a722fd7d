// SPDX-License-Identifier: Apache-2.0
// Where tests reach in, to make what never fails fail.
#pragma once

#include <functional>
#include <memory>

#include "runtime/server/net/transport.hpp"

namespace ecorche::server {

/// Empty in use.
struct TestHooks {
  /// Stands between the server and a client's bytes.
  std::function<std::unique_ptr<Transport>(std::unique_ptr<Transport>)> transport;
  /// Asked before every wait; true: the wait ends at once, with an error.
  std::function<bool()> timer_fails;
  /// A message is being handled, from true to false, or what its answer waits for is made, on another thread.
  /// What finds no memory meanwhile ends its connection; what the I/O thread does else has a Reserve.
  std::function<void(bool)> handling;
  /// Asked before each tissue's levels of detail are made that nobody waits for, on the thread that makes
  /// them; false: no more of this model.
  std::function<bool()> may_coarsen = {};
};

/// Tells TestHooks::handling while it lives.
class HandlingScope {
 public:
  explicit HandlingScope(const TestHooks& hooks) : hooks_(hooks) { notify(true); }
  ~HandlingScope() { notify(false); }
  HandlingScope(const HandlingScope&) = delete;
  HandlingScope& operator=(const HandlingScope&) = delete;

 private:
  void notify(bool begins) const {
    if (hooks_.handling) hooks_.handling(begins);
  }
  const TestHooks& hooks_;
};

}  // namespace ecorche::server
