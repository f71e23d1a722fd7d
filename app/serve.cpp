// SPDX-License-Identifier: Apache-2.0
// `ecorche serve`: models in memory, poses in, frames out.
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <tbb/task_arena.h>

#include <filesystem>
#include <memory>
#include <stop_token>
#include <vector>

#include <ecorche/io/pose_library.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/version.hpp>
#include <ecorche/wire/address.hpp>
#include "app/command.hpp"
#include "app/passed_sockets.hpp"
#include "app/served_clips.hpp"
#include "app/signals.hpp"
#include "app/token_file.hpp"
#include "app/viewer/viewer_files.hpp"
#include "core/files/atomic_file.hpp"
#include "core/platform/heap.hpp"
#include "core/platform/service.hpp"
#include "core/platform/terminal.hpp"
#include "runtime/server/net/web_host.hpp"
#include "runtime/server/server.hpp"

namespace ecorche::app {
namespace {

struct ServeSettings {
  std::vector<std::string> models;
  std::string listen = "127.0.0.1:7070";
  std::string http;  // empty: of this machine alone, by the first port from 7071 on that is free
  bool no_http = false;
  std::string viewer_folder;
  std::string port_file;
  std::string token_file;
  std::string clips;
  std::string log = "info";
  bool real_time = false;
  server::Options options;
};

// `left_knee` for `/data/left_knee.hdf`.
std::string model_name(const std::string& path) {
  return std::filesystem::path(path).stem().string();
}

// Of the library, those that the rig can take. A part of a body may have none of a pose's joints.
std::vector<server::NamedPose> fitting_poses(const Rig& rig) {
  std::vector<server::NamedPose> poses;
  for (const std::string& name : io::library_poses()) {
    try {
      poses.push_back({name, io::library_pose(name, rig).pose});
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::config) throw;
    }
  }
  return poses;
}

server::ModelParts read_model(const std::string& path, const std::string& clips, const Program& program,
                              const Context& context) {
  server::ModelParts parts{.model = std::make_shared<const Model>(model_file::read(path, context))};
  if (!clips.empty()) parts.clips = read_clips(program, clips, parts.model->rig);
  parts.poses = fitting_poses(parts.model->rig);
  return parts;
}

std::vector<server::NamedModel> read_models(const ServeSettings& settings, const Program& program) {
  std::vector<server::NamedModel> models;
  for (const std::string& path : settings.models) {
    server::ModelParts parts = read_model(path, settings.clips, program, program.context("read model"));
    // Later, aside, by a worker: without a bar.
    const auto read_again = [path, clips = settings.clips, &program] {
      return read_model(path, clips, program, Context{});
    };
    models.push_back({model_name(path), std::move(parts.model), std::move(parts.clips), read_again,
                      std::move(parts.poses)});
  }
  return models;
}

server::Endpoint endpoint(const std::string& text) {
  const wire::Address address = wire::parse_address(text);
  return {.host = address.host, .port = address.port};
}

// As `endpoint` reads it.
std::string written(const std::string& host, std::uint16_t port) {
  const bool v6 = host.find(':') != host.npos;
  return (v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

// The HTTP port of who asked for none in particular: others on this machine may have taken it.
constexpr std::uint16_t kHttpPort = 7071, kMorePorts = 63;

server::Options options_of(const ServeSettings& settings) {
  server::Options options = settings.options;
  options.listen = endpoint(settings.listen);
  if (!settings.http.empty()) {
    options.http = endpoint(settings.http);
  } else if (!settings.no_http) {
    options.http = {.host = "127.0.0.1", .port = kHttpPort};
    options.http_more_ports = kMorePorts;
  }
  take_passed_sockets(platform::passed_sockets(), options);
  if (!settings.viewer_folder.empty())
    options.viewer = server::folder_files(settings.viewer_folder);
  else if (!viewer_files().empty())
    options.viewer = server::embedded_files(viewer_files());
  if (!settings.token_file.empty()) options.token = read_token(settings.token_file);
  options.version = ECORCHE_VERSION;
  return options;
}

// What a browser is given. An address of all interfaces is none to ask for.
std::string page_url(const server::Options& options, std::uint16_t port) {
  const std::string& host = options.http->host;
  const bool all = host == "0.0.0.0" || host == "::";
  const std::string& name = all && !options.host_names.empty() ? options.host_names.front() : host;
  return (options.certificate.empty() ? "http://" : "https://") + written(name, port) + "/";
}

std::string check_host_name(const std::string& name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.';
  };
  if (!name.empty() && std::all_of(name.begin(), name.end(), good)) return {};
  return "'" + name + "' is no host name (give it as in viewer.example, without scheme and port)";
}

void tell(const std::string& lines) {
  if (const std::error_code error = platform::tell_service_manager(lines))
    spdlog::warn("the service manager cannot be told: {}", error.message());
}

int run_serve(const ServeSettings& settings, const Program& program) {
  platform::use_tidy_heap();
  // stdout is for the result.
  spdlog::set_default_logger(spdlog::stderr_logger_st("serve"));
  spdlog::set_pattern("%Y-%m-%d %H:%M:%S.%e %l: %v");
  spdlog::set_level(spdlog::level::from_str(settings.log));

  const server::Options options = options_of(settings);
  if (!options.record_folder.empty()) files::make_folder(options.record_folder);

  // The main thread serves; as many workers as threads take up poses, all of them inside one arena, which
  // TBB's own threads join where a single pose leaves cores idle.
  const int threads = program.threads > 0 ? program.threads : tbb::this_task_arena::max_concurrency();
  tbb::task_arena arena(threads);
  server::Workers workers(threads, [&arena](const server::Job& job) { arena.execute(job); });
  server::Server server(options, read_models(settings, program), workers);
  if (settings.real_time && !server::going_first()) {
    throw Error(ErrorKind::refused, "--real-time", "the system does not let this process",
                "give it CAP_SYS_NICE or an RLIMIT_RTPRIO of 1 (ulimit -r 1), or serve without");
  }

  const std::string where = written(options.listen.host, server.port());
  if (!settings.port_file.empty()) {
    std::string ports = std::to_string(server.port()) + "\n";
    if (!settings.http.empty() || (options.http && options.http->passed))
      ports += std::to_string(server.http_port()) + "\n";
    files::write_text(settings.port_file, ports);
  }
  nlohmann::json report{{"address", where}, {"port", server.port()}, {"models", settings.models.size()}};
  std::string text = "listening on " + where;
  if (server.http_port() != 0) {
    const std::string url = page_url(options, server.http_port());
    report["http_port"] = server.http_port();
    report["url"] = url;
    text += ", and " + url;
    // For the eyes of who started it: a file or a journal would keep it.
    if (!options.token.empty() && platform::stdout_is_terminal()) text += "#token=" + options.token;
  }
  program.result(text, report);

  const std::stop_callback on_stop(program.stop, [&server] {
    tell("STOPPING=1");
    server.stop();
  });
  const OnHangup on_hangup([&server] {
    tell(platform::reloading_since_now());
    server.reload([] { tell("READY=1"); });
  });
  tell("READY=1\nSTATUS=listening on " + where);
  server.run();
  return 0;
}

}  // namespace

void declare_serve(CLI::App& app, Program& program, Run& chosen) {
  auto settings = std::make_shared<ServeSettings>();
  CLI::App* command = app.add_subcommand("serve", "serve models: poses in, meshes and volumes out, over TCP");
  command
      ->add_option("models", settings->models, "model files; clients ask for them by file name without .hdf")
      ->required();
  command->add_option("--listen", settings->listen, "HOST:PORT; port 0 picks a free one")
      ->capture_default_str();
  auto* http = command->add_option("--http", settings->http,
                                   "HOST:PORT of the viewer, /healthz, /readyz, /metrics and, at /v1, "
                                   "WebSockets; by default 127.0.0.1 and "
                                   "the first free port from 7071 on");
  command->add_flag("--no-http", settings->no_http, "no such port")->excludes(http);
  command
      ->add_option("--host-name", settings->options.host_names,
                   "a name besides the address of --http by which browsers ask for the viewer; repeatable")
      ->check(check_host_name);
  command->add_option("--viewer-dir", settings->viewer_folder,
                      "show the viewer in this folder, as it is, in place of the program's own");
  command->add_option("--origin", settings->options.origins,
                      "another server's page that may connect, as https://viewer.example; repeatable");
  command->add_option(
      "--port-file", settings->port_file,
      "write the port, and below it that of --http where it is given, to this file once listening");
  command->add_option("--tls-certificate", settings->options.certificate,
                      "speak TLS, as the owner of this PEM chain");
  command->add_option("--tls-key", settings->options.key, "its key, PEM, unencrypted");
  command->add_option("--token-file", settings->token_file, "clients must show the token in this file");
  command->add_option(
      "--clips", settings->clips,
      "a folder of motion files that clients may have played, by file name without its ending");
  command->add_option("--record-dir", settings->options.record_folder,
                      "a folder for what clients have recorded; without it nothing is");
  command->add_flag("--insecure", settings->options.insecure,
                    "listen beyond loopback although TLS or the token is missing");
  command->add_flag("--real-time", settings->real_time,
                    "the thread that answers runs before all others of the machine, for steady latencies");
  command->add_option("--log", settings->log, "what to log on stderr")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();

  server::Limits& limits = settings->options.limits;
  const auto limit = [command](const char* name, auto& value, const char* help, auto min, auto max) {
    command->add_option(name, value, help)
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

  command->callback([settings, &program, &chosen] {
    chosen = [settings, &program] { return run_serve(*settings, program); };
  });
}

}  // namespace ecorche::app
