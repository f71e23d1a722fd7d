// SPDX-License-Identifier: Apache-2.0
#include "bench/server/wire.hpp"

#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>
#include <thread>
#include <vector>

#include <ecorche/client/client.hpp>
#include <ecorche/values/error.hpp>
#include <ecorche/wire/convert.hpp>
#include "bench/server/served.hpp"
#include "bench/server/walking.hpp"
#include "bench/table.hpp"

namespace ecorche::bench {
namespace {

using client::Clock;

std::string row_of(std::string_view way) {
  if (way == "grpc") return "gRPC";
  return way == "bytes" ? "Protobuf over TCP" : "as it lies, over TCP";
}

constexpr double kRate = 20;
constexpr double kWarmUp = 4;  // until the levels of detail are made

struct Times {
  double p50 = 0, p99 = 0, megabytes = 0, cpu_ms = 0;
};

Times ours(const std::string& program, const std::string& model, double seconds) {
  const Served served(program, model);
  client::Client client(served.address(), "bench");
  v1::Envelope open, subscribe;
  open.mutable_open_model()->set_without_triangles(true);
  const v1::ModelOpened opened = client.call(open).envelope.model_opened();
  Rig rig;
  if (!wire::from_proto(opened.skeleton(), rig).ok())
    throw Error(ErrorKind::protocol, "bench", "no rig", "see the server");
  subscribe.mutable_subscribe()->mutable_mesh()->set_encoding(v1::ENCODING_F32);
  client.call(subscribe);
  std::vector<double> ms;
  double cpu = 0;
  Times times;
  const auto start = Clock::now();
  const auto since = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  for (std::uint64_t i = 1; since() < kWarmUp + seconds; ++i) {
    std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(
                                              std::chrono::duration<double>(static_cast<double>(i) / kRate)));
    if (ms.empty()) cpu = served.cpu_seconds() + cpu_seconds();
    v1::Envelope pose;
    pose.mutable_pose_update()->set_sequence(i);
    pose.mutable_pose_update()->set_rig_digest(opened.rig_digest());
    wire::to_proto(walking(rig, static_cast<double>(i) / kRate), *pose.mutable_pose_update());
    const auto sent = Clock::now();
    client.send(pose);
    while (auto frame = client.receive(Clock::now() + std::chrono::seconds(10))) {
      if (frame->envelope.mesh_frame().pose_sequence() != i) continue;
      if (since() > kWarmUp)
        ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - sent).count());
      times.megabytes = static_cast<double>(frame->payload.size()) / 1e6;
      client.reuse(std::move(*frame));  // as the others' clients keep their message
      break;
    }
  }
  times.cpu_ms = 1e3 * (served.cpu_seconds() + cpu_seconds() - cpu) / static_cast<double>(ms.size());
  times.p50 = quantile(ms, 0.5);
  times.p99 = quantile(ms, 0.99);
  return times;
}

}  // namespace

void same_frame(const std::string& program, const std::string& model, const std::string& peers,
                double seconds) {
  const Times own = ours(program, model, seconds);
  const Table table({{"the whole body in float32, 20 Hz", 34},
                     {"MB"},
                     {"p50 ms"},
                     {"p99 ms"},
                     {"processor ms/frame, both sides"},
                     {"ours of their p50 (wanted: 0.6)"},
                     {"ours of their processor"}});
  table.row({"ours", fixed(own.megabytes, 1), fixed(own.p50, 2), fixed(own.p99, 2), fixed(own.cpu_ms, 1)});
  if (!std::filesystem::exists(peers)) {
    table.row({"gRPC: not built"});
    return;
  }
  const std::string command =
      "'" + peers + "' '" + model + "' " + std::to_string(seconds) + " " + std::to_string(kRate);
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  char name[16];
  double p50 = 0, p99 = 0, bytes = 0, cpu = 0;
  while (pipe && std::fscanf(pipe.get(), "%15s %lf %lf %lf %lf", name, &p50, &p99, &bytes, &cpu) == 5) {
    table.row({row_of(name), fixed(bytes / 1e6, 1), fixed(p50, 2), fixed(p99, 2), fixed(cpu, 1),
               fixed(own.p50 / p50, 2), fixed(own.cpu_ms / cpu, 2)});
  }
}

}  // namespace ecorche::bench
