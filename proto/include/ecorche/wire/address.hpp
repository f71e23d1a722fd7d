// SPDX-License-Identifier: Apache-2.0
// `HOST:PORT` as people write it.
#pragma once

#include <charconv>
#include <cstdint>
#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::wire {

/// Where a server listens.
struct Address {
  std::string host;
  std::uint16_t port = 0;
};

/// `127.0.0.1:7070`, `localhost:7070` or `[::1]:7070`. Throws Error{usage}.
inline Address parse_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const char* const end = text.data() + text.size();
  Address address;
  bool good = colon != std::string::npos && colon > 0;
  if (good) {
    const auto [last, ec] = std::from_chars(text.data() + colon + 1, end, address.port);
    good = ec == std::errc() && last == end;
    address.host = text.substr(0, colon);
  }
  if (good && address.host.front() == '[' && address.host.back() == ']')
    address.host = address.host.substr(1, address.host.size() - 2);
  if (!good || address.host.empty()) {
    throw Error(ErrorKind::usage, "address", "'" + text + "' is not HOST:PORT", "write it as 127.0.0.1:7070");
  }
  return address;
}

}  // namespace ecorche::wire
