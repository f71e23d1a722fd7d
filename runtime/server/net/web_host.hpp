// SPDX-License-Identifier: Apache-2.0
// Whether a request can only have come from who knows this machine's address.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <string>
#include <string_view>

#include "core/values/text.hpp"

namespace ecorche::server {

/// True for what `Host` says of an address (`127.0.0.1:9090`, `[::1]`) or of this machine itself
/// (`localhost`, `prometheus.localhost:9090`), and for a request without `Host`. Any other name may be one
/// that a page's owner had point here after a browser had loaded the page (DNS rebinding): to the browser the
/// answer is then that page's own. An address is never a name that moves.
inline bool names_this_machine(std::string_view host) {
  if (host.empty()) return true;
  if (host.front() == '[') {
    const auto end = host.find(']');
    host = end == std::string_view::npos ? std::string_view() : host.substr(1, end - 1);
  } else {
    host = host.substr(0, host.find(':'));
  }
  if (host.ends_with('.')) host.remove_suffix(1);
  const std::string name = text::lower(host);
  if (name == "localhost" || name.ends_with(".localhost")) return true;
  boost::system::error_code ec;
  boost::asio::ip::make_address(name, ec);
  return !ec;
}

}  // namespace ecorche::server
