// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/listen.hpp"

#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::server {

tcp::endpoint endpoint_of(const Endpoint& where, const Options& options) {
  boost::system::error_code ec;
  const net::ip::address address =
      net::ip::make_address(where.host == "localhost" ? "127.0.0.1" : where.host, ec);
  if (ec)
    throw Error(ErrorKind::usage, "listen", "'" + where.host + "' is no address",
                "use a numeric one such as 127.0.0.1:7070");
  const bool guarded = !options.certificate.empty() && !options.token.empty();
  if (!address.is_loopback() && !guarded && !options.insecure) {
    throw Error(ErrorKind::refused, where.host, "is reachable by others, who could read and take part",
                "give --tls-certificate, --tls-key and --token-file, listen on 127.0.0.1 and tunnel, or add "
                "--insecure on a network that you trust");
  }
  return {address, where.port};
}

void start_listening(tcp::acceptor& acceptor, const tcp::endpoint& endpoint) {
  boost::system::error_code ec;
  const std::string where = endpoint.address().to_string() + ":" + std::to_string(endpoint.port());
  const auto check = [&] {
    if (!ec) return;
    if (ec == net::error::address_in_use) {
      throw Error(ErrorKind::temporary, where, "the address is in use",
                  "stop the other server, or --listen on another port; 0 picks a free one");
    }
    throw Error(ErrorKind::usage, where, "cannot listen: " + ec.message(),
                "use an address of this machine and a port that you may use");
  };
  acceptor.open(endpoint.protocol(), ec);
  check();
  acceptor.set_option(tcp::acceptor::reuse_address(true), ec);
  check();
  acceptor.bind(endpoint, ec);
  check();
  acceptor.listen(net::socket_base::max_listen_connections, ec);
  check();
}

}  // namespace ecorche::server
