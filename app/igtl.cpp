// SPDX-License-Identifier: Apache-2.0
// `ecorche igtl`: a posed body for 3D Slicer and other programs that speak OpenIGTLink.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/wire/address.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/igtl/link_server.hpp"
#include "app/pose_frames.hpp"
#include "app/unknown_name.hpp"
#include "core/files/atomic_file.hpp"
#include "core/platform/heap.hpp"
#include "io/case/ik_file.hpp"
#include "runtime/server/listen.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

struct IgtlSettings {
  fs::path model, ik, port_file;
  std::string pose, listen = "127.0.0.1:18944", skinning = "cor", sampling = "trilinear";
  std::vector<std::string> tissues{"all"}, volumes{"all"}, joints, goals;
  bool from_first = false, insecure = false;
  igtl::LinkSettings link;
};

server::tcp::endpoint endpoint_of(const IgtlSettings& settings) {
  const wire::Address address = wire::parse_address(settings.listen);
  server::Options anywhere;
  anywhere.insecure = true;
  server::tcp::endpoint out = server::endpoint_of({.host = address.host, .port = address.port}, anywhere);
  if (!out.address().is_loopback() && !settings.insecure) {
    throw Error(ErrorKind::refused, address.host,
                "is reachable by others, and OpenIGTLink knows neither passwords nor encryption",
                "listen on 127.0.0.1 and tunnel, or add --insecure on a network that you trust");
  }
  return out;
}

// The rows of what `words` name; `all` and `none` are words, too.
template <class Items>
std::vector<std::uint32_t> rows_of(const std::string& option, const std::vector<std::string>& words,
                                   const Items& items) {
  std::vector<std::uint32_t> rows;
  const bool all = words == std::vector<std::string>{"all"};
  for (std::uint32_t row = 0; all && row < items.size(); ++row) rows.push_back(row);
  if (all || words == std::vector<std::string>{"none"}) return rows;
  for (const std::string& word : words) {
    const auto found =
        std::find_if(items.begin(), items.end(), [&word](const auto& one) { return one.name == word; });
    if (found == items.end()) throw unknown_name(option, word, items);
    rows.push_back(static_cast<std::uint32_t>(found - items.begin()));
  }
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

// `TOOL=SEGMENT`.
std::vector<igtl::Binding> bindings_of(const std::string& option, const std::vector<std::string>& words,
                                       const Skeleton& skeleton) {
  std::vector<igtl::Binding> out;
  for (const std::string& word : words) {
    const std::size_t sign = word.find('=');
    if (sign == word.npos || sign == 0 || sign > igtl::kDeviceBytes) {
      throw Error(ErrorKind::usage, option, "'" + word + "' is not TOOL=SEGMENT",
                  "write it as Stylus=hand_right, with a tool's name of 1 to 20 letters");
    }
    const std::string segment = word.substr(sign + 1), tool = word.substr(0, sign);
    const int row = skeleton.find_segment(segment);
    if (row < 0) throw unknown_name(option, segment, skeleton.segments);
    // Slicer keeps what it sends and what it gets under one name, and would send our answers back.
    if (skeleton.find_segment(tool) >= 0) {
      throw Error(ErrorKind::usage, option, "'" + tool + "' is what a segment's own transform is sent as",
                  "give the tool another name");
    }
    out.push_back({tool, static_cast<std::size_t>(row)});
  }
  return out;
}

// What the pose begins with, and what it is asked.
io::IkRequest request_of(const Program& program, const IgtlSettings& settings, const Rig& rig) {
  if (!settings.ik.empty()) return io::read_ik(settings.ik, rig);
  io::IkRequest out;
  out.start = Pose::rest(rig.skeleton.segments.size());
  if (settings.pose.empty()) return out;
  FrameChoice choice;
  choice.pose = settings.pose;
  out.start = read_frames(program, choice, rig).front().pose;
  return out;
}

void report(const Program& program, const std::string& where, std::uint16_t port, const igtl::Choice& choice,
            const igtl::PosedMessages& body) {
  nlohmann::json names = nlohmann::json::object();
  std::string text = "listening on " + where + " for OpenIGTLink: " + std::to_string(choice.tissues.size()) +
                     " surfaces, " + std::to_string(choice.volumes.size()) + " images\n";
  for (const auto& [name, fitting] : body.shortened()) {
    names[name] = fitting;
    text.append(name).append(" is sent as ").append(fitting).append("\n");
  }
  program.result(text, {{"address", where},
                        {"port", port},
                        {"surfaces", choice.tissues.size()},
                        {"images", choice.volumes.size()},
                        {"shortened", names}});
}

int run_igtl(const Program& program, IgtlSettings& settings) {
  platform::use_tidy_heap();
  settings.link.listen = endpoint_of(settings);
  const auto model = std::make_shared<const Model>(model_file::read(settings.model, program.context("read")));
  const Skeleton& skeleton = model->rig.skeleton;
  const igtl::Choice choice{
      .tissues = rows_of("--tissues", settings.tissues, model->tissues),
      .volumes = rows_of("--volumes", settings.volumes, model->volumes),
      .skinning = runtime::skinning_from_name(settings.skinning),
      .sampling = settings.sampling == "nearest" ? runtime::Sampling::nearest : runtime::Sampling::trilinear};
  io::IkRequest request = request_of(program, settings, model->rig);
  const igtl::Bindings bindings{bindings_of("--joint", settings.joints, skeleton),
                                bindings_of("--goal", settings.goals, skeleton), settings.from_first};
  igtl::PosedMessages body(model, choice);
  igtl::LinkServer server(
      program, settings.link, model->rig, body,
      igtl::TrackedPose(model->rig, std::move(request.start), std::move(request.problem), bindings));
  const std::string host = settings.link.listen.address().to_string();
  const std::string where = (settings.link.listen.address().is_v6() ? "[" + host + "]" : host) + ":" +
                            std::to_string(server.port());
  if (!settings.port_file.empty())
    files::write_text(settings.port_file, std::to_string(server.port()) + "\n");
  report(program, where, server.port(), choice, body);
  server.run();
  return 0;
}

}  // namespace

void declare_igtl(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<IgtlSettings>();
  CLI::App* command = app.add_subcommand(
      "igtl",
      "a posed body over OpenIGTLink, as for 3D Slicer: surfaces, images and motions out, tracked tools in");
  command->add_option("MODEL", s->model, "a model that preprocess made")->required();
  command->add_option("--listen", s->listen, "HOST:PORT; port 0 picks a free one")->capture_default_str();
  command->add_option("--port-file", s->port_file, "write the port to this file once listening");
  command->add_flag("--insecure", s->insecure, "listen beyond loopback: OpenIGTLink keeps nobody out");
  auto* pose = command->add_option("--pose", s->pose, "where to begin: a pose file, or lib:NAME");
  command->add_option("--ik", s->ik, "where to begin: goals and pins of points, as for pose --ik")
      ->excludes(pose);
  command->add_option(
      "--joint", s->joints,
      "TOOL=SEGMENT: the transform TOOL is the motion of the segment from the scan, and turns its "
      "joint; repeatable");
  command->add_option(
      "--goal", s->goals,
      "TOOL=SEGMENT: a point of the segment (of --ik, or its joint's centre) goes where the transform "
      "TOOL is; repeatable");
  command->add_flag("--from-first", s->from_first,
                    "a tool counts from where it was first: it may be fixed to the body in any way");
  command->add_option("--tissues", s->tissues, "surfaces to send: all, none, or names with commas between")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--volumes", s->volumes, "images to send: all, none, or names with commas between")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--skinning", s->skinning, "how segments blend: cor, dqs or lbs")
      ->check(CLI::IsMember({"cor", "dqs", "lbs"}))
      ->capture_default_str();
  command->add_option("--sampling", s->sampling, "of images: nearest or trilinear; labels are always nearest")
      ->check(CLI::IsMember({"nearest", "trilinear"}))
      ->capture_default_str();
  command->add_option("--rate", s->link.rate, "poses a second at most")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  command
      ->add_option("--rest-seconds", s->link.rest_seconds,
                   "that a body must hold still before its images are posed")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  const auto limit = [command](const char* name, auto& value, const char* help, auto min, auto max) {
    command->add_option(name, value, help)
        ->check(CLI::Range(min, max))
        ->capture_default_str()
        ->group("Limits");
  };
  limit("--max-message-bytes", s->link.limits.message_bytes, "of what a client sends", std::uint64_t{1024},
        std::uint64_t{1} << 30);
  limit("--max-connections", s->link.connections, "at once", 1U, 1024U);
  limit("--stall-seconds", s->link.limits.stall_seconds,
        "until a client that stands still within a message is dropped", 0.01, 3600.0);
  command->callback([s, &program, &chosen] { chosen = [s, &program] { return run_igtl(program, *s); }; });
}

}  // namespace ecorche::app
