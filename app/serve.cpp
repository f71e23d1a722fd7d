// SPDX-License-Identifier: Apache-2.0
// `ecorche serve`: models in memory, poses in, frames out.
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <tbb/task_arena.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <vector>

#include <ecorche/io/pose_library.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/version.hpp>
#include <ecorche/wire/address.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/config_file.hpp"
#include "app/json_log.hpp"
#include "app/passed_sockets.hpp"
#include "app/serve_options.hpp"
#include "app/served_clips.hpp"
#include "app/signals.hpp"
#include "app/token_file.hpp"
#include "app/tokens_file.hpp"
#include "app/viewer/viewer_files.hpp"
#include "core/files/atomic_file.hpp"
#include "core/files/page_store.hpp"
#include "core/platform/heap.hpp"
#include "core/platform/service.hpp"
#include "core/platform/terminal.hpp"
#include "runtime/server/net/web_host.hpp"
#include "runtime/server/server.hpp"

namespace ecorche::app {
namespace {

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
  if (!settings.tokens.empty()) {
    options.passes = read_tokens(settings.tokens);
    options.read_passes = [path = settings.tokens] { return read_tokens(path); };
  }
  if (!settings.shared_models.empty())
    options.pages = std::make_shared<const files::PageStore>(settings.shared_models);
  if (!options.elsewhere.empty()) wire::parse_address(options.elsewhere);
  if (settings.log_format == "json") options.log = json_lines();
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

void tell(const std::string& lines) {
  if (const std::error_code error = platform::tell_service_manager(lines))
    spdlog::warn("the service manager cannot be told: {}", error.message());
}

// All that serving does before it listens: another server may have the ports.
int check_config(const ServeSettings& settings, const server::Options& options, const Program& program) {
  server::Server::check(options);
  const std::size_t models = read_models(settings, program).size();
  const std::size_t tokens = options.passes.size() + (options.token.empty() ? 0 : 1);
  const std::string where = written(options.listen.host, options.listen.port);
  program.result("the configuration is good: " + std::to_string(models) + " models, " +
                     std::to_string(tokens) + " tokens, to listen on " + where,
                 {{"models", models}, {"tokens", tokens}, {"address", where}});
  return 0;
}

int run_serve(const ServeSettings& settings, const Program& program) {
  platform::use_tidy_heap();
  if (settings.merge_pages && !platform::merge_equal_pages()) {
    throw Error(ErrorKind::refused, "--merge-pages", "this kernel cannot",
                "use Linux 6.4 or newer, or serve without");
  }
  // stdout is for the result.
  spdlog::set_default_logger(spdlog::stderr_logger_mt("serve"));
  spdlog::set_pattern("%Y-%m-%d %H:%M:%S.%e %l: %v");
  if (settings.log_format == "json") log_as_json();
  spdlog::set_level(spdlog::level::from_str(settings.log));

  const server::Options options = options_of(settings);
  if (settings.check_config) return check_config(settings, options, program);
  if (!options.record_folder.empty()) files::make_folder(options.record_folder);

  // The main thread serves; as many workers as threads take up poses, all of them inside one arena, which
  // TBB's own threads join where a single pose leaves cores idle.
  const int threads = program.threads > 0 ? program.threads : tbb::this_task_arena::max_concurrency();
  tbb::task_arena arena(threads);
  std::optional<server::LastInArena> frames_last;
  if (settings.probes_first) frames_last.emplace(arena);
  server::Workers workers(threads, [&arena](const server::Job& job) { arena.execute(job); });
  server::Server server(options, read_models(settings, program), workers);
  server::going_soon();
  if (settings.real_time && !server::going_first()) {
    throw Error(ErrorKind::refused, "--real-time", "the system does not let this process",
                "give it CAP_SYS_NICE or an RLIMIT_RTPRIO of 1 (ulimit -r 1), or serve without");
  }

  // Before anybody is told where it listens: who knows may send a signal.
  const std::stop_callback on_stop(program.stop, [&server] {
    tell("STOPPING=1");
    server.stop();
  });
  const OnHangup on_hangup([&server] {
    tell(platform::reloading_since_now());
    server.reload([] { tell("READY=1"); });
  });

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

  if (!program.stop.stop_requested()) tell("READY=1\nSTATUS=listening on " + where);
  server.run();
  return 0;
}

}  // namespace

void declare_serve(CLI::App& app, Program& program, Run& chosen) {
  auto settings = std::make_shared<ServeSettings>();
  CLI::App* command = app.add_subcommand("serve", "serve models: poses in, meshes and volumes out, over TCP");
  declare_serve_options(*command, *settings);
  command->callback([settings, command, &program, &chosen] {
    if (!settings->config.empty()) take_config(*command, settings->config);
    if (settings->models.empty())
      throw Error(ErrorKind::usage, "ecorche serve", "models is required", "see ecorche serve --help");
    chosen = [settings, &program] { return run_serve(*settings, program); };
  });
}

}  // namespace ecorche::app
