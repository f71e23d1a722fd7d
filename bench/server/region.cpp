// SPDX-License-Identifier: Apache-2.0
#include "bench/server/region.hpp"

#include <chrono>
#include <cstring>
#include <thread>
#include <vector>

#include <ecorche/client/client.hpp>
#include <ecorche/values/error.hpp>
#include <ecorche/wire/convert.hpp>
#include "bench/server/walking.hpp"
#include "proto/arrays.hpp"

namespace ecorche::bench {
namespace {

using client::Clock;

// The box of `edge` voxel centres each way around the middle of the grid.
v1::Box middle_of(const ImageGrid& grid, int edge) {
  v1::Box box;
  std::array<std::array<double, 2>, 3> ends{};
  const auto first = [&](std::size_t a) { return grid.size[a] / 2 - edge / 2; };
  const auto low = grid.point(first(0), first(1), first(2));
  const auto high = grid.point(first(0) + edge - 1, first(1) + edge - 1, first(2) + edge - 1);
  for (std::size_t a = 0; a < 3; ++a) ends[a] = {std::min(low[a], high[a]), std::max(low[a], high[a])};
  const auto set = [&](v1::Vector3& out, std::size_t end) {
    out.set_x(ends[0][end]);
    out.set_y(ends[1][end]);
    out.set_z(ends[2][end]);
  };
  set(*box.mutable_min(), 0);
  set(*box.mutable_max(), 1);
  return box;
}

double held_in(const v1::VolumeFrame& frame, const wire::Payload& payload, std::int16_t background) {
  std::span<const std::byte> voxels;
  if (!wire::find(frame.voxels(), payload, voxels))
    throw Error(ErrorKind::protocol, "bench", "no voxels", "see the server");
  double held = 0;
  for (std::size_t v = 0; v + 1 < voxels.size(); v += 2) {
    std::int16_t value = 0;
    std::memcpy(&value, &voxels[v], 2);
    held += value != background;
  }
  return held;
}

}  // namespace

RegionRate region_rate(const Served& served, v1::Deformer deformer, int edge, double seconds) {
  client::Client client(served.address(), "bench");
  v1::Envelope open;
  open.mutable_open_model()->set_without_triangles(true);
  const v1::ModelOpened opened = client.call(open).envelope.model_opened();
  const v1::Volume& volume = opened.volumes(0);
  if (volume.type() != v1::SCALAR_TYPE_I16 || volume.components() != 1)
    throw Error(ErrorKind::usage, "bench", "the model's first volume is no 16-bit CT", "give another model");
  Rig rig;
  ImageGrid grid;
  if (!wire::from_proto(opened.skeleton(), rig).ok() || !wire::from_proto(volume.grid(), grid).ok())
    throw Error(ErrorKind::protocol, "bench", "no rig or grid", "see the server");
  v1::Envelope subscribe;
  v1::VolumeSelection& selection = *subscribe.mutable_subscribe()->mutable_volume();
  selection.set_volume(volume.name());
  selection.set_deformer(deformer);
  *selection.mutable_region() = middle_of(grid, edge);
  client.call(subscribe);

  RegionRate out;
  std::vector<double> latency, posed, encoded;
  double looked_at = 0;
  const auto now = [] { return Clock::now(); };
  const auto since = [&](Clock::time_point then) {
    return std::chrono::duration<double>(now() - then).count();
  };
  // Levels of detail are made first, beside which frames take longer.
  std::this_thread::sleep_for(std::chrono::seconds(5));
  // The first frames find where to bridge, and touch the memory.
  constexpr std::uint64_t warm_up = 3;
  auto start = now();
  double cpu = 0;
  for (std::uint64_t sequence = 1; sequence <= warm_up || since(start) < seconds; ++sequence) {
    if (sequence == warm_up + 1) {
      start = now();
      cpu = served.cpu_seconds();
    }
    v1::Envelope envelope;
    v1::PoseUpdate& update = *envelope.mutable_pose_update();
    update.set_sequence(sequence);
    update.set_rig_digest(opened.rig_digest());
    Pose pose = walking(rig, static_cast<double>(sequence) / 20);
    pose.root_translation.setZero();  // it walks on the spot, within the region
    wire::to_proto(pose, update);
    const auto sent = now();
    client.send(envelope);
    for (;;) {
      const auto frame = client.receive_in_place(sent + client::Client::patience);
      if (!frame) throw Error(ErrorKind::protocol, "bench", "no frame came", "see the server");
      if (!frame->envelope.has_volume_frame() || frame->envelope.volume_frame().pose_sequence() != sequence)
        continue;
      const v1::VolumeFrame& got = frame->envelope.volume_frame();
      if (got.status().code() != 0)
        throw Error(ErrorKind::protocol, "bench", got.status().message(), "see the server");
      if (sequence > warm_up) {
        latency.push_back(1e3 * since(sent));
        posed.push_back(static_cast<double>(got.timings().posed()) / 1e3);
        encoded.push_back(static_cast<double>(got.timings().encoded()) / 1e3);
      } else {
        out.held += held_in(got, frame->payload, static_cast<std::int16_t>(volume.background()));
        ++looked_at;
      }
      break;
    }
  }
  out.cpu_ms = 1e3 * (served.cpu_seconds() - cpu) / static_cast<double>(latency.size());
  out.per_second = static_cast<double>(latency.size()) / since(start);
  out.p50_ms = quantile(latency, 0.5);
  out.p99_ms = quantile(latency, 0.99);
  out.posed_ms = quantile(posed, 0.5);
  out.encoded_ms = quantile(encoded, 0.5);
  out.held /= looked_at;
  return out;
}

}  // namespace ecorche::bench
