// SPDX-License-Identifier: Apache-2.0
// What a server may be told, and the safe defaults.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/server/net/passes.hpp"
#include "runtime/server/resources/journal.hpp"

namespace ecorche::files {
class PageStore;
}  // namespace ecorche::files

namespace ecorche::server {

/// Field by field as in proto/ecorche/v1/hello.proto, which tells clients.
struct Limits {
  std::uint32_t hello_bytes = 4 << 10;
  double hello_seconds = 5;
  std::uint32_t envelope_bytes = 64 << 10;
  std::uint32_t payload_bytes = 1 << 20;
  std::uint32_t connections = 256;
  std::uint32_t models = 8;
  std::uint32_t sessions = 64;        ///< each holds a pose, and keyframes
  std::uint32_t subscriptions = 16;   ///< per connection
  double poses_per_second = 240;      ///< per session
  double messages_per_second = 2000;  ///< per connection; 90 Hz of poses and acknowledgements are 180
  std::uint32_t frames_in_flight = 2;
  std::uint64_t queued_bytes = std::uint64_t{512} << 20;  ///< of frames that wait for clients, all together
  std::uint64_t kept_bytes = std::uint64_t{4} << 30;      ///< by streams and probes, all together
  std::uint64_t frame_bytes = std::uint64_t{256} << 20;   ///< of one frame
  double requests_per_second = 100;                       ///< over HTTP, of one address and kind (WebKind)
  double stall_seconds = 10;
  double idle_seconds = 300;
  double linger_seconds = 60;
  std::uint64_t volume_voxels = std::uint64_t{256} << 20;
  std::uint64_t record_bytes = std::uint64_t{64} << 20;  ///< of one recording
  std::uint32_t recordings = 4;                          ///< at once
  std::uint32_t recording_files = 256;                   ///< in their folder
  double recordings_per_minute = 6;                      ///< begun by clients of one address
  double recording_days = 30;                            ///< until one makes way in a full folder
  double log_lines_per_second = 2;  ///< for clients of one address; of all ten times as many
  double peer_share = 0.75;  ///< of connections, sessions, recordings and bytes: to one address (Shares)
  double connection_share = 0.25;  ///< of queued_bytes and kept_bytes: to one connection
};

struct Endpoint {
  std::string host = "127.0.0.1";            ///< a numeric address, or localhost
  std::uint16_t port = 0;                    ///< 0: any free one
  std::optional<std::intptr_t> passed = {};  ///< a socket that listens there already
};

class WebFiles;

struct Options {
  Endpoint listen{.host = "127.0.0.1", .port = 7070};
  std::optional<Endpoint> http;         ///< the viewer, health, metrics and WebSockets; none by default
  std::uint16_t http_more_ports = 0;    ///< where that port is taken, so many after it are tried
  std::vector<std::string> origins;     ///< others' pages that may connect, e.g. `https://viewer.example`
  std::vector<std::string> host_names;  ///< by which browsers ask, besides the address of `http`
  std::shared_ptr<const WebFiles> viewer = {};  ///< that `http` shows; null: none
  std::string certificate, key;  ///< PEM files; both or neither. With them both ports speak TLS only
  std::string token;             ///< who shows it may do all; clients must show one, where there is any
  std::vector<Pass> passes;      ///< and others, each with rights and limits of its own
  std::function<std::vector<Pass>()> read_passes = {};  ///< reload() has them read again by it; may be empty
  bool insecure = false;                ///< listen beyond loopback although TLS or the token is missing
  std::filesystem::path record_folder;  ///< empty: nothing is recorded
  std::string version;                  ///< of the program, for ServerHello
  /// stop() lets clients go on for so long, and newcomers in, while /readyz says 503: time for who asks that
  /// to send newcomers elsewhere. Then clients are told to come back at once, to another server.
  double drain_seconds = 0;
  std::string elsewhere;  ///< and to whom: HOST:PORT of frames; empty: to the same address
  Journal::Write log;     ///< takes the log's lines about clients and sessions; none: spdlog, as text
  Limits limits;
  std::shared_ptr<const files::PageStore> pages = {};  ///< for what servers of a machine have alike; or null
};

}  // namespace ecorche::server
