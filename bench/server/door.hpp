// SPDX-License-Identifier: Apache-2.0
// A server that does nothing for those who come.
#pragma once

#include <sys/types.h>

#include <cstddef>

#include <ecorche/wire/address.hpp>

namespace ecorche::bench {

/// A process that accepts whoever comes to its port on loopback, sends each `bytes` zeros as far as the
/// connection takes them, and says no more; it ends with this object. What others on the machine feel of
/// those who come there, they would feel of any server's.
class Door {
 public:
  explicit Door(std::size_t bytes);
  ~Door();
  Door(const Door&) = delete;
  Door& operator=(const Door&) = delete;

  const wire::Address& address() const { return address_; }

 private:
  wire::Address address_;
  pid_t child_ = -1;
};

}  // namespace ecorche::bench
