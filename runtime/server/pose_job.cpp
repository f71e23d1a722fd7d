// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/pose_job.hpp"

#include <new>
#include <utility>

#include "proto/arrays.hpp"
#include "proto/convert.hpp"
#include "runtime/quality/pose_quality.hpp"
#include "runtime/server/recording.hpp"

namespace ecorche::server {
namespace {

std::uint64_t microseconds(Clock::duration time) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(time).count());
}

// Calls `work`; what it throws comes back as a status.
template <class Work>
Status guarded(Work&& work) {
  try {
    return work();
  } catch (const Error& error) {
    return to_status(error);
  } catch (const std::bad_alloc&) {
    return {StatusCode::resource_exhausted, "pose: the server is out of memory (ask for less)"};
  } catch (const std::exception& error) {
    return {StatusCode::internal, error.what()};
  }
}

// Every tissue that some subscription shows, ascending.
std::vector<std::uint32_t> all_wanted(const PoseJob& job) {
  std::vector<bool> wanted(job.model->model().tissues.size());
  for (const Subscription& subscription : job.subscriptions) {
    if (const auto* mesh = std::get_if<MeshWant>(&subscription.want)) {
      for (const std::uint32_t tissue : mesh->tissues) wanted[tissue] = true;
    }
  }
  std::vector<std::uint32_t> rows;
  for (std::uint32_t row = 0; row < wanted.size(); ++row) {
    if (wanted[row]) rows.push_back(row);
  }
  return rows;
}

// Quality, probes and volumes by tets look at every tet; meshes only at those that their vertices hang on,
// spheres at none.
runtime::NodesOf nodes_wanted(const PoseJob& job) {
  if (job.probe) return runtime::NodesOf::body;
  for (const Subscription& subscription : job.subscriptions) {
    const auto* mesh = std::get_if<MeshWant>(&subscription.want);
    const auto* volume = std::get_if<VolumeWant>(&subscription.want);
    if ((mesh && mesh->quality) || (volume && !volume->by_spheres)) return runtime::NodesOf::body;
  }
  return runtime::NodesOf::tissues;
}

void describe(const runtime::PoseQuality& quality, const std::vector<std::uint32_t>& tissues,
              v1::PoseQuality& out) {
  out.set_verdict(quality.pass ? v1::PoseQuality::VERDICT_PASS : v1::PoseQuality::VERDICT_WARN);
  out.set_inverted_tets(quality.inverted_tets);
  out.set_inverted_share(quality.inverted_share);
  out.set_min_det_f(quality.min_det_f);
  out.set_volume_change(quality.volume_change);
  for (std::size_t i = 0; i < quality.tissues.size(); ++i) {
    v1::TissueChange& change = *out.add_tissues();
    change.set_tissue(tissues[i]);
    if (quality.tissues[i].closed) change.set_share(quality.tissues[i].share);
  }
  out.set_bone_rigidity(quality.bone_rigidity_mm);
  out.set_max_inverted_share(quality.thresholds.max_inverted_share);
  out.set_max_volume_change(quality.thresholds.max_volume_change);
  out.set_max_bone_rigidity(quality.thresholds.max_bone_rigidity_mm);
}

PosedFrame mesh_frame(const PoseJob& job, const Subscription& subscription, const MeshWant& want,
                      const runtime::PosedBody& body, const v1::ServerTimings& timings) {
  const auto start = Clock::now();
  v1::Envelope envelope;
  v1::MeshFrame& frame = *envelope.mutable_mesh_frame();
  frame.set_subscription(subscription.id);
  frame.set_frame(job.number);
  frame.set_pose_sequence(job.request.sequence);
  frame.set_topology_digest(job.model->opened.topology_digest());
  frame.set_encoding(v1::ENCODING_F32);

  auto payload = std::make_shared<wire::Payload>();
  std::size_t bytes = 0;
  for (const std::uint32_t tissue : want.tissues)
    bytes += wire::aligned(body.tissues[tissue].size() * sizeof(float));
  payload->reserve(bytes);
  for (const std::uint32_t tissue : want.tissues) {
    v1::MeshArray& array = *frame.add_arrays();
    array.set_tissue(tissue);
    array.set_kind(v1::MeshArray::KIND_POSITIONS);
    *array.mutable_array() = wire::append(*payload, std::span<const float>(body.tissues[tissue]), 3);
  }
  if (want.quality) {
    describe(runtime::measure(job.model->model(), body, want.tissues, job.thresholds, job.model->closed),
             want.tissues, *frame.mutable_quality());
  }
  *frame.mutable_timings() = timings;
  frame.mutable_timings()->set_encoded(microseconds(Clock::now() - start));
  return {subscription.id, job.number,
          std::make_shared<wire::EncodedFrame>(wire::encode(envelope, std::move(payload)))};
}

Status check_size(const ImageGrid& grid, const PoseJob& job) {
  if (grid.voxels() <= job.volume_voxels) return {};
  return {StatusCode::resource_exhausted, "volume: the posed grid has " + std::to_string(grid.voxels()) +
                                              " voxels (at most " + std::to_string(job.volume_voxels) +
                                              "; keep the body nearer to the scan)"};
}

// The voxels of `frame` and its description; a status where there can be none.
Status fill_volume(const PoseJob& job, const VolumeWant& want, const runtime::PosedBody& body,
                   v1::VolumeFrame& frame, std::shared_ptr<const wire::Payload>& payload) {
  const Model& model = job.model->model();
  const ModelVolume& volume = model.volumes[want.volume];
  Image image;
  if (want.by_spheres) {
    const runtime::BallSet set = runtime::balls_for(model, body.segments, volume);
    const runtime::LatticeBox box = runtime::box_for(set, want.region);
    if (Status status = check_size(grid_of(set.lattice, box), job); !status.ok()) return status;
    image = runtime::refill(set, box, volume.image, volume.background, want.sampling);
  } else {
    const ImageGrid grid = runtime::grow_to(volume.image.grid, body.nodes);
    if (Status status = check_size(grid, job); !status.ok()) return status;
    runtime::VolumePoser::Scratch scratch;
    job.model->volumes.pose(body.nodes, volume, want.sampling, grid, image, scratch);
  }
  const ImageGrid grid = image.grid;
  wire::to_proto(grid, *frame.mutable_grid());
  v1::Array& voxels = *frame.mutable_voxels();
  voxels.set_type(wire::to_proto(image.type));
  voxels.set_components(static_cast<std::uint32_t>(image.components));
  voxels.set_count(grid.voxels());
  voxels.set_offset(0);
  image.bytes.resize(wire::aligned(image.bytes.size()));
  payload = std::make_shared<const wire::Payload>(std::move(image.bytes));
  return {};
}

PosedFrame volume_frame(const PoseJob& job, const Subscription& subscription, const VolumeWant& want,
                        const runtime::PosedBody& body, const v1::ServerTimings& timings) {
  const auto start = Clock::now();
  v1::Envelope envelope;
  v1::VolumeFrame& frame = *envelope.mutable_volume_frame();
  frame.set_subscription(subscription.id);
  frame.set_frame(job.number);
  frame.set_pose_sequence(job.request.sequence);
  frame.set_volume(want.volume);
  std::shared_ptr<const wire::Payload> payload;
  const Status status = guarded([&] { return fill_volume(job, want, body, frame, payload); });
  wire::to_proto(status, *frame.mutable_status());
  *frame.mutable_timings() = timings;
  frame.mutable_timings()->set_encoded(microseconds(Clock::now() - start));
  return {subscription.id, job.number,
          std::make_shared<wire::EncodedFrame>(wire::encode(envelope, std::move(payload)))};
}

void hand_over(const PoseJob& job, PosedFrame frame) {
  if (job.digests) frame.digest = digest_of(*frame.bytes);
  job.on_frame(std::move(frame));
}

}  // namespace

Status run(const PoseJob& job, runtime::PosedBody& body) {
  const auto start = Clock::now();
  PoseOutcome outcome;
  outcome.sequence = job.request.sequence;
  outcome.timings.set_waited(microseconds(start - job.request.arrived));
  outcome.status = guarded([&] {
    // A session's body is made at its first pose: sessions that only wait cost nothing.
    if (body.segments.empty()) body = job.model->poser.make_frame();
    return job.model->poser.run(job.request.pose, job.request.skinning, all_wanted(job), body,
                                nodes_wanted(job));
  });
  outcome.timings.set_posed(microseconds(Clock::now() - start));
  const v1::ServerTimings timings = outcome.timings;
  const bool posed = outcome.status.ok();
  if (posed) outcome.clamped = body.clamped;
  job.on_outcome(std::move(outcome));
  if (!posed) return {};

  return guarded([&] {
    if (job.probe) {
      job.model->probe().follow(body.nodes, job.probe->tree);
      job.probe->sequence = job.request.sequence;
      job.on_probe();
    }
    for (const Subscription& subscription : job.subscriptions) {
      const auto* want = std::get_if<MeshWant>(&subscription.want);
      if (want) hand_over(job, mesh_frame(job, subscription, *want, body, timings));
    }
    for (const Subscription& subscription : job.subscriptions) {
      const auto* want = std::get_if<VolumeWant>(&subscription.want);
      if (want) hand_over(job, volume_frame(job, subscription, *want, body, timings));
    }
    return Status{};
  });
}

}  // namespace ecorche::server
