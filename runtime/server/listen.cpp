// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/listen.hpp"

#include <algorithm>
#include <string>

#include <ecorche/values/error.hpp>
#include "runtime/server/net/tls.hpp"
#include "runtime/server/server.hpp"

namespace ecorche::server {
namespace {

boost::system::error_code try_listening(tcp::acceptor& acceptor, const tcp::endpoint& endpoint) {
  boost::system::error_code ec, ignored;
  acceptor.open(endpoint.protocol(), ec);
  if (!ec) acceptor.set_option(tcp::acceptor::reuse_address(true), ec);
  if (!ec) acceptor.bind(endpoint, ec);
  if (!ec) acceptor.listen(net::socket_base::max_listen_connections, ec);
  if (ec) acceptor.close(ignored);
  return ec;
}

}  // namespace

void check_options(const Options& options) {
  if (options.certificate.empty() != options.key.empty())
    throw Error(ErrorKind::usage, "TLS", "a certificate and its key go together",
                "give both --tls-certificate and --tls-key");
  constexpr std::size_t shortest = 16, longest = 1024;
  if (!options.token.empty() && (options.token.size() < shortest || options.token.size() > longest))
    throw Error(ErrorKind::config, "token", "it has " + std::to_string(options.token.size()) + " characters",
                "use 16 to 1024 that nobody can guess, e.g. of openssl rand -hex 32");
}

void Server::check(const Options& options) {
  check_options(options);
  endpoint_of(options.listen, options);
  if (options.http) endpoint_of(*options.http, options);
  const Carrier carrier(options.certificate, options.key);
}

tcp::endpoint endpoint_of(const Endpoint& where, const Options& options) {
  boost::system::error_code ec;
  const net::ip::address address =
      net::ip::make_address(where.host == "localhost" ? "127.0.0.1" : where.host, ec);
  if (ec)
    throw Error(ErrorKind::usage, "listen", "'" + where.host + "' is no address",
                "use a numeric one such as 127.0.0.1:7070");
  const bool guarded = !options.certificate.empty() && (!options.token.empty() || !options.passes.empty());
  if (!address.is_loopback() && !guarded && !options.insecure) {
    throw Error(ErrorKind::refused, where.host, "is reachable by others, who could read and take part",
                "give --tls-certificate, --tls-key and --token-file, listen on 127.0.0.1 and tunnel, or add "
                "--insecure on a network that you trust");
  }
  return {address, where.port};
}

void start_listening(tcp::acceptor& acceptor, const tcp::endpoint& endpoint,
                     const std::optional<std::intptr_t>& passed, std::uint16_t more_ports) {
  const auto ports_left = static_cast<std::uint16_t>(65535 - endpoint.port());
  const std::uint16_t more = endpoint.port() == 0 ? std::uint16_t{0} : std::min(more_ports, ports_left);
  boost::system::error_code ec;
  if (passed) {
    acceptor.assign(endpoint.protocol(), static_cast<tcp::acceptor::native_handle_type>(*passed), ec);
    if (!ec) return;
    throw Error(ErrorKind::config, "LISTEN_FDS", "a passed socket cannot be used: " + ec.message(),
                "let the server listen by itself");
  }
  for (std::uint32_t port = endpoint.port(); port <= std::uint32_t{endpoint.port()} + more; ++port) {
    ec = try_listening(acceptor, {endpoint.address(), static_cast<std::uint16_t>(port)});
    if (ec != net::error::address_in_use) break;
  }
  if (!ec) return;
  const std::string where = endpoint.address().to_string() + ":" + std::to_string(endpoint.port());
  if (ec == net::error::address_in_use) {
    throw Error(ErrorKind::temporary, where, "the address is in use",
                "stop the other server, or use another port; 0 picks a free one");
  }
  throw Error(ErrorKind::usage, where, "cannot listen: " + ec.message(),
              "use an address of this machine and a port that you may use");
}

}  // namespace ecorche::server
