// SPDX-License-Identifier: Apache-2.0
// The HTTP port: /healthz, /readyz, /metrics, and /v1, where a WebSocket begins.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "runtime/server/net/transport.hpp"

namespace ecorche::server {

/// What a request is for, each with a rate of its own: a page, a WebSocket, one that has shown the token.
/// What asks for /healthz or /readyz is none of them: it is always answered.
enum class WebKind : std::uint8_t { page, handshake, proven };

/// What the HTTP port asks the server.
struct WebContext {
  std::string token;                 ///< empty: none is asked for
  std::vector<std::string> origins;  ///< pages that may connect, as browsers name them
  std::size_t header_bytes = 4 << 10;
  double messages_per_second = 2000;  ///< of a client, pings among them
  std::function<bool()> ready;
  std::function<std::string()> metrics;
  std::function<void()> denied;
  /// Whether one more request of this kind and peer may be answered now.
  std::function<bool(WebKind kind, const std::string& peer)> admit;
  /// A client that speaks WebSocket from here on; `proven`: its request had the token.
  std::function<void(std::unique_ptr<Transport> transport, std::string peer, bool proven)> welcome;
};

/// One request of one client, answered, and the connection ends; or it becomes a WebSocket, and goes on as
/// another client of the server. Whoever owns it sets its deadline by close().
class WebRequest : public std::enable_shared_from_this<WebRequest> {
 public:
  virtual ~WebRequest() = default;
  virtual void start() = 0;
  virtual void close() = 0;
  /// Closed, or gone on.
  virtual bool over() const = 0;
  Clock::time_point born() const { return born_; }

 private:
  Clock::time_point born_ = Clock::now();
};

/// `context` outlives it.
std::shared_ptr<WebRequest> web_request(std::unique_ptr<Transport> transport, std::string peer,
                                        const WebContext& context);

}  // namespace ecorche::server
