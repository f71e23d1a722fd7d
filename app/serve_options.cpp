// SPDX-License-Identifier: Apache-2.0
#include "app/serve_options.hpp"

#include <algorithm>

#include "app/cli.hpp"

namespace ecorche::app {
namespace {

std::string check_host_name(const std::string& name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.';
  };
  if (!name.empty() && std::all_of(name.begin(), name.end(), good)) return {};
  return "'" + name + "' is no host name (give it as in viewer.example, without scheme and port)";
}

}  // namespace

void declare_serve_options(CLI::App& command, ServeSettings& settings) {
  command.add_option("models", settings.models,
                     "model files; clients ask for them by file name without .hdf");
  command.add_option(
      "--config", settings.config,
      "a YAML file of options, each by its name with _ for -; what is said here goes before it");
  command.add_flag("--check-config", settings.check_config,
                   "read and check all that serving would, say whether it is good, and serve nothing");
  command.add_option("--listen", settings.listen, "HOST:PORT; port 0 picks a free one")
      ->capture_default_str();
  auto* http = command.add_option("--http", settings.http,
                                  "HOST:PORT of the viewer, /healthz, /readyz, /metrics and, at /v1, "
                                  "WebSockets; by default 127.0.0.1 and "
                                  "the first free port from 7071 on");
  command.add_flag("--no-http", settings.no_http, "no such port")->excludes(http);
  command
      .add_option("--host-name", settings.options.host_names,
                  "a name besides the address of --http by which browsers ask for the viewer; repeatable")
      ->check(check_host_name);
  command.add_option("--viewer-dir", settings.viewer_folder,
                     "show the viewer in this folder, as it is, in place of the program's own");
  command.add_option("--origin", settings.options.origins,
                     "another server's page that may connect, as https://viewer.example; repeatable");
  command.add_option(
      "--port-file", settings.port_file,
      "write the port, and below it that of --http where it is given, to this file once listening");
  command.add_option("--tls-certificate", settings.options.certificate,
                     "speak TLS, as the owner of this PEM chain");
  command.add_option("--tls-key", settings.options.key, "its key, PEM, unencrypted");
  auto* token_file = command.add_option("--token-file", settings.token_file,
                                        "clients must show the token in this file, and may then do all");
  command
      .add_option(
          "--tokens", settings.tokens,
          "clients must show one of the tokens of which this YAML file has digests, roles and limits; "
          "SIGHUP has it read again")
      ->excludes(token_file);
  command.add_option(
      "--clips", settings.clips,
      "a folder of motion files that clients may have played, by file name without its ending");
  command.add_option("--record-dir", settings.options.record_folder,
                     "a folder for what clients have recorded; without it nothing is");
  command.add_flag("--insecure", settings.options.insecure,
                   "listen beyond loopback although TLS or the token is missing");
  command.add_flag("--real-time", settings.real_time,
                   "the thread that answers runs before all others of the machine, for steady latencies");
  command.add_flag("--probes-first", settings.probes_first,
                   "frames give way to whatever else wakes on this machine, so that probes are nearly always "
                   "answered within a millisecond beside them; not beside programs that keep all cores busy");
  command.add_flag(
      "--merge-pages", settings.merge_pages,
      "let the kernel keep one copy of what several servers of this machine have in memory alike");
  command.add_option("--shared-models", settings.shared_models,
                     "a folder in memory (tmpfs), where servers of this machine keep one copy of what their "
                     "models have alike; made for this user where it is missing");
  command.add_option("--log", settings.log, "what to log on stderr")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  command
      .add_option("--log-format", settings.log_format, "of the log: lines for people, or an object a line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  command
      .add_option("--drain-seconds", settings.options.drain_seconds,
                  "after SIGTERM, until clients are told to go to another server; /readyz says 503 meanwhile")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  command.add_option(
      "--elsewhere", settings.options.elsewhere,
      "HOST:PORT where they are told to go; without it, to where they are, behind which another "
      "server is by then");

  server::Limits& limits = settings.options.limits;
  const auto limit = [&command](const char* name, auto& value, const char* help, auto min, auto max) {
    command.add_option(name, value, help)
        ->check(CLI::Range(min, max))
        ->capture_default_str()
        ->group("Limits");
  };
  limit("--max-hello-bytes", limits.hello_bytes, "of a client's first message", 64U, 1U << 20);
  limit("--hello-seconds", limits.hello_seconds, "until a client's first message", 0.01, 3600.0);
  limit("--max-envelope-bytes", limits.envelope_bytes, "of any other envelope of a client", 1024U, 1U << 30);
  limit("--max-payload-bytes", limits.payload_bytes, "of a client's payload", 0U, 1U << 30);
  limit("--max-connections", limits.connections, "at once", 1U, 65536U);
  limit("--max-models", limits.models, "in memory", 1U, 1024U);
  limit("--max-sessions", limits.sessions, "at once", 1U, 65536U);
  limit("--max-subscriptions", limits.subscriptions, "per connection", 1U, 1024U);
  limit("--pose-rate", limits.poses_per_second, "poses per second and session; faster ones are skipped", 0.1,
        1e6);
  limit("--message-rate", limits.messages_per_second, "messages per second and connection; faster ones wait",
        1.0, 1e6);
  limit("--request-rate", limits.requests_per_second,
        "HTTP requests per second of one address, by kind; others are turned away, but for /healthz and "
        "/readyz",
        1.0, 1e6);
  limit("--frames-in-flight", limits.frames_in_flight, "unacknowledged, per subscription", 1U, 64U);
  limit("--max-queued-bytes", limits.queued_bytes, "of frames that wait for clients, all together",
        std::uint64_t{1} << 20, std::uint64_t{1} << 40);
  limit("--max-kept-bytes", limits.kept_bytes, "that subscriptions and probes keep, all together",
        std::uint64_t{1} << 20, std::uint64_t{1} << 40);
  limit("--stall-seconds", limits.stall_seconds, "until a client that stopped reading is dropped", 0.01,
        3600.0);
  limit("--idle-seconds", limits.idle_seconds, "until a client that says nothing is dropped", 0.01, 1e6);
  limit("--linger-seconds", limits.linger_seconds, "that a named session outlives its connections", 0.0, 1e6);
  limit("--max-volume-voxels", limits.volume_voxels, "of a posed volume", std::uint64_t{1},
        std::uint64_t{1} << 31);
  limit("--max-frame-bytes", limits.frame_bytes, "of a frame, before compression", std::uint64_t{1} << 20,
        std::uint64_t{1} << 32);
  limit("--max-record-bytes", limits.record_bytes, "of a recording", std::uint64_t{4096},
        std::uint64_t{1} << 30);
  limit("--max-recordings", limits.recordings, "that run at once", 1U, 1024U);
  limit("--max-recording-files", limits.recording_files, "in their folder", 1U, 1U << 20);
  limit("--recording-rate", limits.recordings_per_minute,
        "recordings a minute that clients of one address begin, after four in one go", 0.01, 1e6);
  limit("--recording-days", limits.recording_days,
        "after which a recording makes way where the folder is full", 0.0, 1e6);
  limit("--log-rate", limits.log_lines_per_second,
        "lines a second that clients of one address cause in the log; all together ten times as many", 0.01,
        1e6);
  limit("--peer-share", limits.peer_share,
        "of connections, sessions, recordings and kept bytes: for clients of one address", 0.01, 1.0);
  limit("--connection-share", limits.connection_share, "of queued and kept bytes: for one connection", 0.01,
        1.0);
}

}  // namespace ecorche::app
