// SPDX-License-Identifier: Apache-2.0
// By which names a server is asked for.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/values/text.hpp"

namespace ecorche::server {

/// The name in what `Host` says, without port and brackets, in lower case; an address as it is usually
/// written.
inline std::string host_name(std::string_view host) {
  if (host.starts_with('[')) {
    const auto end = host.find(']');
    host = end == std::string_view::npos ? std::string_view() : host.substr(1, end - 1);
  } else {
    host = host.substr(0, host.find(':'));
  }
  if (host.ends_with('.')) host.remove_suffix(1);
  std::string name = text::lower(host);
  boost::system::error_code ec;
  const auto address = boost::asio::ip::make_address(name, ec);
  return ec ? name : address.to_string();
}

inline bool is_address(const std::string& name) {
  boost::system::error_code ec;
  boost::asio::ip::make_address(name, ec);
  return !ec;
}

/// True for what `Host` says of an address (`127.0.0.1:9090`, `[::1]`) or of this machine itself
/// (`localhost`, `prometheus.localhost:9090`), and for a request without `Host`. Any other name may be one
/// that a page's owner had point here after a browser had loaded the page (DNS rebinding): to the browser the
/// answer is then that page's own. An address is never a name that moves.
inline bool names_this_machine(std::string_view host) {
  if (host.empty()) return true;
  const std::string name = host_name(host);
  return name == "localhost" || name.ends_with(".localhost") || is_address(name);
}

/// The names that a server was started for. A browser that asks by another one was led here by whoever owns
/// that name.
class HostList {
 public:
  HostList() = default;
  /// The address that it listens at, on loopback also that of the machine's own names, on all interfaces any
  /// address; and `more` names.
  HostList(const boost::asio::ip::address& listening, const std::vector<std::string>& more)
      : any_address_(listening.is_unspecified()), names_{listening.to_string()} {
    if (listening.is_loopback() || any_address_) names_.insert({"localhost", "127.0.0.1", "::1"});
    for (const std::string& name : more) names_.insert(host_name(name));
  }

  /// Of a `Host` header. No browser leaves it out.
  bool has(std::string_view host) const {
    if (host.empty()) return true;
    const std::string name = host_name(host);
    return names_.contains(name) || (any_address_ && is_address(name));
  }

 private:
  bool any_address_ = false;
  std::set<std::string> names_;
};

/// What is asked for is a WebSocket of the protocol. More may stand behind it, such as the session, by which
/// a balancer in front chooses a server (docs/how-to/several_servers.md).
inline bool is_socket_target(std::string_view target) {
  return target.substr(0, target.find('?')) == "/v1";
}

/// Whether a page of this origin (`http://localhost:7071`) was asked of the server that `host` names. `tls`:
/// that speaks TLS itself; else a proxy may have taken it off.
inline bool same_origin(std::string_view origin, std::string_view host, bool tls) {
  const std::string_view secure = "https://", plain = "http://";
  const std::string_view scheme = origin.starts_with(secure) ? secure : plain;
  if (!origin.starts_with(scheme) || (tls && scheme != secure) || host.empty()) return false;
  return text::lower(origin.substr(scheme.size())) == text::lower(host);
}

}  // namespace ecorche::server
