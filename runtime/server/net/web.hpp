// SPDX-License-Identifier: Apache-2.0
// The HTTP port: /healthz, /readyz, /metrics, /v1, where a WebSocket begins, and the viewer for browsers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "runtime/server/net/passes.hpp"
#include "runtime/server/net/transport.hpp"
#include "runtime/server/net/web_files.hpp"
#include "runtime/server/net/web_host.hpp"

namespace ecorche::server {

/// What a request is for, each with a rate of its own: a page, a WebSocket, one that has shown the token.
/// What asks for /healthz or /readyz is none of them: it is always answered.
enum class WebKind : std::uint8_t { page, handshake, proven };

/// What the HTTP port asks the server.
struct WebContext {
  std::shared_ptr<const Passes> passes = std::make_shared<const Passes>(std::vector<Pass>());
  std::vector<std::string> origins;        ///< pages of others that may connect, as browsers name them
  bool tls = false;                        ///< it is spoken on this port
  HostList hosts;                          ///< by which browsers may ask, and whose own pages may connect
  std::shared_ptr<const WebFiles> viewer;  ///< null: there is none
  std::size_t header_bytes = 4 << 10;
  double messages_per_second = 2000;  ///< of a client, pings among them
  std::function<bool()> ready;
  std::function<std::string()> metrics;
  std::function<void()> denied;
  /// Whether one more request of this kind and peer may be answered now.
  std::function<bool(WebKind kind, const std::string& peer)> admit;
  /// A client that speaks WebSocket from here on; `pass`: of the token that its request had; null: it had
  /// none.
  std::function<void(std::unique_ptr<Transport> transport, std::string peer,
                     std::shared_ptr<const Pass> pass)>
      welcome;
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
  /// When it was born or, once it is answered with a file, when a part of that was last taken.
  Clock::time_point moved() const { return moved_; }
  /// It is being answered with a file, which may take long.
  bool sending() const { return moved_ != born_; }

 protected:
  void has_moved() { moved_ = Clock::now(); }

 private:
  Clock::time_point born_ = Clock::now(), moved_ = born_;
};

/// `context` outlives it.
std::shared_ptr<WebRequest> web_request(std::unique_ptr<Transport> transport, std::string peer,
                                        const WebContext& context);

}  // namespace ecorche::server
