// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/pose_job.hpp"

#include <new>
#include <utility>

#include "proto/convert.hpp"
#include "runtime/quality/pose_quality.hpp"
#include "runtime/server/mesh_stream.hpp"
#include "runtime/server/recording.hpp"
#include "runtime/server/volume_stream.hpp"

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

// What the tissues of the model are posed for: every tissue that some subscription shows.
struct Wanted {
  explicit Wanted(std::size_t tissues)
      : shown(tissues), positions(tissues), numbers(tissues), normals(tissues) {}

  std::vector<bool> shown, positions, numbers, normals;  // by row of Model::tissues

  void add(const MeshStream& stream) {
    // Who moves the vertices itself needs the nodes alone.
    if (stream.want().control_nodes && !stream.want().quality) return;
    for (const std::uint32_t tissue : stream.want().tissues) {
      shown[tissue] = true;
      if (stream.needs_positions()) positions[tissue] = true;
      if (stream.needs_numbers()) numbers[tissue] = true;
      if (stream.want().normals) normals[tissue] = true;
    }
  }
  static std::vector<std::uint32_t> rows(const std::vector<bool>& which) {
    std::vector<std::uint32_t> rows;
    for (std::uint32_t row = 0; row < which.size(); ++row) {
      if (which[row]) rows.push_back(row);
    }
    return rows;
  }
  // Gives the body the arrays that are wanted and takes the others away, so that nothing is written in vain.
  void shape(const Model& model, runtime::PosedBody& body) const {
    for (std::size_t t = 0; t < shown.size(); ++t) {
      const auto size = static_cast<std::size_t>(model.tissues[t].V.size());
      body.tissues[t].resize(positions[t] ? size : 0);
      body.quantised[t].resize(numbers[t] ? size : 0);
      body.normals[t].resize(normals[t] ? size : 0);
    }
  }
};

// Quality, probes and volumes by tets look at every tet; meshes only at those that their vertices hang on,
// spheres at none.
runtime::NodesOf nodes_wanted(const PoseJob& job) {
  if (job.probe) return runtime::NodesOf::body;
  for (const Subscription& subscription : job.subscriptions) {
    const auto* mesh = std::get_if<MeshWant>(&subscription.want);
    const auto* volume = std::get_if<VolumeWant>(&subscription.want);
    if ((mesh && (mesh->quality || mesh->control_nodes)) || (volume && !volume->by_spheres))
      return runtime::NodesOf::body;
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

void describe(const ClampedJoint& clamped, const Skeleton& skeleton, v1::ClampedJoint& out) {
  out.set_joint(static_cast<std::uint32_t>(clamped.joint));
  out.set_name(skeleton.segments[static_cast<std::size_t>(clamped.joint)].joint.name);
  out.set_removed(clamped.removed);
}

PosedFrame mesh_frame(const PoseJob& job, const Subscription& subscription, std::size_t at,
                      const runtime::PosedBody& body, bool fits, const v1::ServerTimings& timings) {
  MeshStream& stream = *subscription.streams[at];
  v1::Envelope envelope;
  v1::MeshFrame& frame = *envelope.mutable_mesh_frame();
  frame.set_subscription(subscription.id);
  frame.set_frame(job.number);
  frame.set_pose_sequence(job.request.sequence);
  frame.set_topology_digest(job.model->opened.topology_digest());
  *frame.mutable_timings() = timings;
  if (stream.want().quality) {
    const auto start = Clock::now();
    const std::vector<std::uint32_t>& tissues = stream.want().tissues;
    describe(job.model->meter.measure(body, tissues, job.thresholds), tissues, *frame.mutable_quality());
    frame.mutable_timings()->set_measured(microseconds(Clock::now() - start));
  }
  for (const ClampedJoint& clamped : body.clamped) {
    describe(clamped, job.model->model().rig.skeleton, *frame.add_clamped());
  }
  const auto start = Clock::now();
  auto payload = std::make_shared<wire::Payload>();
  stream.write(body, fits, (subscription.keyframes >> at & 1) != 0, frame, *payload);
  frame.mutable_timings()->set_encoded(microseconds(Clock::now() - start));
  return {.subscription = subscription.id,
          .level = stream.level(),
          .number = job.number,
          .keyframe = frame.keyframe(),
          .encoded = frame.timings().encoded(),
          .bytes = std::make_shared<wire::EncodedFrame>(wire::encode(envelope, std::move(payload)))};
}

PosedFrame volume_frame(const PoseJob& job, const Subscription& subscription, const runtime::PosedBody& body,
                        const v1::ServerTimings& timings) {
  const auto start = Clock::now();
  v1::Envelope envelope;
  v1::VolumeFrame& frame = *envelope.mutable_volume_frame();
  frame.set_subscription(subscription.id);
  frame.set_frame(job.number);
  frame.set_pose_sequence(job.request.sequence);
  frame.set_volume(subscription.volume->want().volume);
  const std::shared_ptr<wire::Payload> payload = subscription.volume->payload();
  const Status status = guarded([&] {
    return subscription.volume->write(*job.model, body, job.volume_voxels, (subscription.keyframes & 1) != 0,
                                      frame, *payload);
  });
  if (!status.ok()) payload->clear();
  wire::to_proto(status, *frame.mutable_status());
  *frame.mutable_timings() = timings;
  frame.mutable_timings()->set_encoded(microseconds(Clock::now() - start));
  return {.subscription = subscription.id,
          .level = 0,
          .number = job.number,
          .keyframe = frame.keyframe(),
          .encoded = frame.timings().encoded(),
          .bytes = std::make_shared<wire::EncodedFrame>(wire::encode(envelope, payload))};
}

Status pose(const PoseJob& job, runtime::PosedBody& body, bool& fits) {
  const runtime::BodyPoser& poser = job.model->poser;
  // A session's body is made at its first pose: sessions that only wait cost nothing.
  if (body.segments.empty()) body = poser.make_frame({.positions = false});
  Wanted wanted(poser.model().tissues.size());
  for (const Subscription& subscription : job.subscriptions) {
    if (!subscription.streams.empty()) wanted.add(*subscription.streams[0]);
  }
  const std::vector<std::uint32_t> tissues = Wanted::rows(wanted.shown),
                                   numbers = Wanted::rows(wanted.numbers);
  wanted.shape(poser.model(), body);
  const auto pose_once = [&] {
    return poser.run(job.request.pose, job.request.skinning, tissues, body, nodes_wanted(job));
  };
  if (Status status = pose_once(); !status.ok()) return status;
  fits = fits_box(body, numbers);
  if (fits) return {};
  wanted.positions = wanted.shown;
  wanted.shape(poser.model(), body);
  return pose_once();
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
  bool fits = true;  // the box of the u16 encodings
  outcome.status = guarded([&] { return pose(job, body, fits); });
  outcome.timings.set_posed(microseconds(Clock::now() - start));
  const v1::ServerTimings timings = outcome.timings;
  const bool posed = outcome.status.ok();
  if (posed) outcome.clamped = body.clamped;
  job.on_outcome(std::move(outcome));
  if (!posed) return {};

  // The streams that somebody wants a frame of.
  const auto each_stream = [&](auto&& work) {
    for (const Subscription& subscription : job.subscriptions) {
      for (std::size_t i = 0; i < subscription.streams.size(); ++i) {
        if ((subscription.levels >> i & 1) != 0) work(subscription, i);
      }
    }
  };
  return guarded([&] {
    if (job.probe) {
      job.model->probe().follow(body.nodes, job.probe->tree);
      job.probe->sequence = job.request.sequence;
      job.on_probe();
    }
    each_stream([&](const Subscription& subscription, std::size_t i) {
      hand_over(job, mesh_frame(job, subscription, i, body, fits, timings));
    });
    for (const Subscription& subscription : job.subscriptions) {
      if (subscription.volume) hand_over(job, volume_frame(job, subscription, body, timings));
    }
    // Once everything is on its way.
    each_stream(
        [&](const Subscription& subscription, std::size_t i) { subscription.streams[i]->settle(body); });
    return Status{};
  });
}

}  // namespace ecorche::server
