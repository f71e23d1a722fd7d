// SPDX-License-Identifier: Apache-2.0
// The server: framed Protobuf over TCP, TLS and WebSockets (docs/reference/protocol.md).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "runtime/server/registry/named_model.hpp"
#include "runtime/server/resources/options.hpp"
#include "runtime/server/schedule/workers.hpp"

namespace ecorche::server {

struct TestHooks;

/// One I/O thread holds every connection and session; workers pose.
///
///            I/O thread                                              workers
///   client --> Connection --.                                    .--> PoseJob (skin, measure,
///   client --> Connection ---+--> Session (one slot, newest wins)       resample, encode once)
///   client --> Connection <-'        ^       one job in flight          |
///        frames, shared              '---------- posted back -----------'
///
/// A frame is immutable once posted; every subscriber's socket writes the same bytes.
class Server {
 public:
  /// Binds and listens. Throws Error{temporary} when the address is in use, Error{usage} for one that cannot
  /// be or half of TLS, Error{refused} beyond loopback without TLS and a token (unless Options::insecure),
  /// Error{config} for too many models or two of one name, and for files that are no certificate.
  Server(Options options, std::vector<NamedModel> models, Workers& workers);
  ~Server();
  /// Throws what the constructor would for these options, without listening.
  static void check(const Options& options);
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The port it listens on.
  std::uint16_t port() const;
  /// That of Options::http; 0 without.
  std::uint16_t http_port() const;

  /// Serves on the calling thread until stop(), then says Goodbye to all, lets them read for up to a second,
  /// and returns once the last job has ended.
  void run();

  /// From any thread, any number of times, also before run(). Clients first have Options::drain_seconds.
  void stop();
  /// Reads the passes and all models again, in the background, as ReloadModel does; the log tells how each
  /// went. Whose pass is gone is ended. As stop().
  /// `done` is called on the thread that serves, where that has not stopped before.
  void reload(std::function<void()> done = {});

 protected:
  /// For tests: what never fails is made to fail (registry/test_hooks.hpp).
  Server(Options options, std::vector<NamedModel> models, Workers& workers, TestHooks hooks);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ecorche::server
