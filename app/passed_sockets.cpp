// SPDX-License-Identifier: Apache-2.0
#include "app/passed_sockets.hpp"

#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::app {
namespace {

server::Endpoint passed_endpoint(const platform::PassedSocket& socket) {
  return {.host = socket.host, .port = socket.port, .passed = socket.handle};
}

}  // namespace

void take_passed_sockets(const std::vector<platform::PassedSocket>& sockets, server::Options& options) {
  for (const platform::PassedSocket& socket : sockets) {
    if (!options.listen.passed && socket.name != "http") {
      options.listen = passed_endpoint(socket);
    } else if (!options.http) {
      throw Error(ErrorKind::config, "LISTEN_FDS", "a socket for HTTP is passed, and --no-http given",
                  "pass one socket alone, or leave --no-http out");
    } else if (!options.http->passed) {
      options.http = passed_endpoint(socket);
      options.http_more_ports = 0;
    } else {
      throw Error(ErrorKind::config, "LISTEN_FDS",
                  std::to_string(sockets.size()) + " sockets are passed, for two ports",
                  "pass one for frames, and one for HTTP");
    }
  }
}

}  // namespace ecorche::app
