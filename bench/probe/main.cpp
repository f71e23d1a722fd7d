// SPDX-License-Identifier: Apache-2.0
// One point a millisecond through a body that streams at 90 Hz, over loopback; then 10000 points a message.
// bench/probe/run calls it, and makes a table of the one JSON object that it prints.
//
// usage: bench_probe MODEL.hdf SECONDS f32|deltas nobody|probes|server|both
// The last word: who goes first. Nobody; probes, as under --probes-first, which asks for no rights; or by the
// kernel's real-time class the server's thread, as under --real-time, or that of who probes as well, as a
// haptic device's loop would be.
#include <spdlog/spdlog.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <ecorche/client/client.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/wire/convert.hpp>
#include "proto/arrays.hpp"
#include "runtime/server/server.hpp"

namespace {

using namespace ecorche;
using client::Clock;

double milliseconds(Clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

std::string spread(std::vector<double> took) {
  std::sort(took.begin(), took.end());
  const auto at = [&](double share) {
    return took[static_cast<std::size_t>(share * static_cast<double>(took.size() - 1))];
  };
  const auto within = std::upper_bound(took.begin(), took.end(), 1.0) - took.begin();
  char out[200];
  std::snprintf(out, sizeof out,
                R"({"p50": %.4f, "p90": %.4f, "p99": %.4f, "most": %.4f, "within_1_ms": %.4f})", at(0.5),
                at(0.9), at(0.99), took.back(),
                static_cast<double>(within) / static_cast<double>(took.size()));
  return out;
}

v1::ModelOpened open(client::Client& client) {
  v1::Envelope request;
  request.mutable_open_model()->set_session("probed");
  request.mutable_open_model()->set_without_triangles(true);
  return client.call(request).envelope.model_opened();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5)
    return std::fprintf(stderr,
                        "usage: bench_probe MODEL.hdf SECONDS f32|deltas nobody|probes|server|both\n"),
           64;
  spdlog::set_level(spdlog::level::warn);  // standard output is for one JSON object
  const double seconds = std::atof(argv[2]);
  const auto model = std::make_shared<const Model>(model_file::read(argv[1], Context{}));
  const std::string_view first = argv[4];
  tbb::task_arena arena;
  std::optional<server::LastInArena> frames_last;
  if (first == "probes") frames_last.emplace(arena);
  server::Workers workers(2, [&](const server::Job& job) { arena.execute(job); });
  server::Options options;
  options.listen.port = 0;
  server::Server server(options, {{"body", model}}, workers);
  std::atomic<bool> allowed = true;
  const auto go_first = [&allowed](bool wanted) {
    if (wanted && !server::going_first()) allowed = false;
  };
  std::thread serving([&] {
    server::going_soon();
    go_first(first == "server" || first == "both");
    server.run();
  });
  const wire::Address address{"127.0.0.1", server.port()};

  std::atomic<bool> done = false;
  std::atomic<std::uint64_t> frames = 0;
  client::Client poser(address, "bench_probe");
  const v1::ModelOpened opened = open(poser);
  v1::Envelope subscribe;
  v1::MeshSelection& mesh = *subscribe.mutable_subscribe()->mutable_mesh();
  const bool deltas = argv[3] == std::string_view("deltas");
  mesh.set_encoding(deltas ? v1::ENCODING_U16_DELTA : v1::ENCODING_F32);
  poser.call(subscribe);
  std::thread posing([&] {
    auto due = Clock::now();
    for (std::uint64_t sequence = 1; !done; ++sequence) {
      v1::Envelope envelope;
      v1::PoseUpdate& update = *envelope.mutable_pose_update();
      Pose pose = Pose::rest(model->segment_count());
      for (std::size_t j = 1; j < pose.rotation.size(); ++j)
        pose.rotation[j] =
            Eigen::AngleAxisd(0.1 * std::sin(0.05 * static_cast<double>(sequence)), Eigen::Vector3d::UnitX());
      update.set_sequence(sequence);
      update.set_rig_digest(opened.rig_digest());
      wire::to_proto(pose, update);
      poser.send(envelope);
      due += std::chrono::nanoseconds(1'000'000'000 / 90);
      while (auto frame = poser.receive(due)) frames += frame->envelope.has_mesh_frame() ? 1 : 0;
    }
  });

  // The middle of the body's nodes, so that the point is inside most of the time.
  client::Client prober(address, "bench_probe");
  open(prober);
  const auto ask = [&](std::size_t count) {
    std::vector<double> points;
    const std::size_t nodes = model->node_count();
    for (std::size_t i = 0; i < count; ++i) {
      const auto row = static_cast<Eigen::Index>(nodes * (i + 1) / (count + 1));
      for (int axis = 0; axis < 3; ++axis) points.push_back(model->nodes(row, axis));
    }
    wire::Payload payload;
    v1::Envelope envelope;
    envelope.mutable_probe_points()->set_direction(v1::ProbePoints::DIRECTION_POSED_TO_REST);
    envelope.mutable_probe_points()->set_deformation_gradient(true);
    *envelope.mutable_probe_points()->mutable_points() =
        wire::append(payload, std::span<const double>(points), 3);
    const auto start = Clock::now();
    prober.call(std::move(envelope), std::make_shared<const wire::Payload>(std::move(payload)));
    return milliseconds(Clock::now() - start);
  };
  // Levels of detail are made meanwhile, which takes a processor seconds, once.
  for (int i = 0; i < 3000; ++i) {
    ask(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  go_first(first == "both");
  std::vector<double> one, many;
  const std::uint64_t before = frames;
  const auto start = Clock::now();
  auto due = start;
  while (milliseconds(Clock::now() - start) < 1000 * seconds) {
    one.push_back(ask(1));
    due = std::max(due + std::chrono::milliseconds(1), Clock::now());
    std::this_thread::sleep_until(due);
  }
  const double took = milliseconds(Clock::now() - start) / 1000;
  const double probed = static_cast<double>(one.size()) / took;
  const double seen = static_cast<double>(frames - before) / took;
  for (int i = 0; i < 50; ++i) many.push_back(ask(10000));
  std::printf(R"({"allowed": %s, "probes": %.1f, "frames": %.1f, "one": %s, "many": %s})"
              "\n",
              allowed ? "true" : "false", probed, seen, spread(one).c_str(), spread(many).c_str());
  done = true;
  posing.join();
  server.stop();
  serving.join();
}
