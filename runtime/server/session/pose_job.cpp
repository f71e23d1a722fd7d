// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/pose_job.hpp"

#include <algorithm>
#include <utility>

#include <ecorche/wire/convert.hpp>
#include "runtime/server/resources/guarded.hpp"
#include "runtime/server/schedule/serially.hpp"
#include "runtime/server/session/mesh_stream.hpp"
#include "runtime/server/session/pose_state.hpp"
#include "runtime/server/session/quality_job.hpp"
#include "runtime/server/session/recording.hpp"
#include "runtime/server/session/volume_stream.hpp"

namespace ecorche::server {
namespace {

std::uint64_t microseconds(Clock::duration time) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(time).count());
}

// What the tissues of the model are posed for: every tissue that some subscription shows.
struct Wanted {
  explicit Wanted(std::size_t tissues)
      : shown(tissues), positions(tissues), numbers(tissues), normals(tissues) {}

  std::vector<bool> shown, positions, numbers, normals;  // by row of Model::tissues

  // `measured`: its quality is.
  void add(const MeshStream& stream, bool measured) {
    // Who moves the vertices itself needs the nodes alone.
    if (stream.moved_by_client() && !measured) return;
    for (const std::uint32_t tissue : stream.spec().tissues) {
      shown[tissue] = true;
      if (stream.needs_positions() || measured) positions[tissue] = true;
      if (stream.needs_numbers()) numbers[tissue] = true;
      if (stream.spec().normals) normals[tissue] = true;
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

// Whether the quality of this pose is measured with the subscription's frame, which then waits for it.
bool measured(const PoseJob& job, const Subscription& subscription) {
  const auto* mesh = std::get_if<MeshSpec>(&subscription.spec);
  if (!mesh) return false;
  if (!subscription.quality) return true;
  return (mesh->quality || job.judge) && subscription.quality->pose_sequence() != job.request.sequence;
}

// Quality and volumes by tets look at every tet, probes, too, but find their own way to its nodes; meshes
// only at those that their vertices hang on, spheres at none.
runtime::NodesOf nodes_wanted(const PoseJob& job) {
  for (const Subscription& subscription : job.subscriptions) {
    const auto* mesh = std::get_if<MeshSpec>(&subscription.spec);
    const auto* volume = std::get_if<VolumeSpec>(&subscription.spec);
    if ((mesh && (measured(job, subscription) || mesh->control_nodes)) || (volume && !volume->by_spheres))
      return runtime::NodesOf::body;
  }
  return job.probe ? runtime::NodesOf::lanes : runtime::NodesOf::tissues;
}

void describe(const ClampedJoint& clamped, const Skeleton& skeleton, v1::ClampedJoint& out) {
  out.set_joint(static_cast<std::uint32_t>(clamped.joint));
  out.set_name(skeleton.segments[static_cast<std::size_t>(clamped.joint)].joint.name);
  out.set_removed(clamped.removed);
}

// The quality that the subscription's frames tell, and whether it is this pose's, just measured.
struct Judged {
  std::shared_ptr<const v1::PoseQuality> quality;
  bool now = false;
  std::uint64_t took = 0;  // microseconds
};

Judged judge(const PoseJob& job, const Subscription& subscription, const runtime::PosedBody& body) {
  if (!measured(job, subscription)) return {subscription.quality};
  const auto start = Clock::now();
  const MeshSpec& mesh = std::get<MeshSpec>(subscription.spec);
  const std::vector<std::uint32_t>& tissues = mesh.tissues;
  // Where the body went far, its float32 positions are too coarse to be measured.
  const BodyPool::Lease still =
      runtime::stands_still(body) ? BodyPool::Lease() : pose_still(*job.model, job.request, tissues);
  const runtime::QualityMeter& meter = job.model->meter();
  const runtime::PosedBody& measured_body = still ? *still : body;
  // Who asks for it with every frame waits for all of it; of others no frame waits for distances of bones.
  const runtime::PoseQuality found = mesh.quality ? meter.measure(measured_body, tissues, job.thresholds)
                                                  : meter.measure_now(measured_body, tissues, job.thresholds);
  auto quality =
      std::make_shared<const v1::PoseQuality>(server::describe(found, tissues, job.request.sequence));
  return {std::move(quality), true, microseconds(Clock::now() - start)};
}

// `everywhere`: with positions of all that is shown, whatever else is wanted of it.
Status pose(const PoseJob& job, runtime::PosedBody& body, bool everywhere = false) {
  const runtime::BodyPoser& poser = job.model->poser();
  Wanted wanted(poser.model().tissues.size());
  for (const Subscription& subscription : job.subscriptions) {
    const bool measures = measured(job, subscription);
    if (subscription.streams.empty() || (subscription.rest && !measures)) continue;
    wanted.add(*subscription.streams[0], measures);
  }
  if (everywhere) wanted.positions = wanted.shown;
  wanted.shape(poser.model(), body);
  return poser.run(job.request.pose, job.request.skinning, Wanted::rows(wanted.shown), body,
                   nodes_wanted(job));
}

// Gives the frame the body's arrays, and the body spent ones in their place.
std::shared_ptr<const Positions> give(const PoseJob& job, const MeshStream& stream,
                                      runtime::PosedBody& body) {
  const std::shared_ptr<Positions> given = job.model->positions->take();
  const std::vector<std::uint32_t>& wanted = stream.spec().tissues;
  bool fits = given->size() == body.tissues.size();
  for (std::uint32_t t = 0; t < body.tissues.size() && fits; ++t)
    fits = std::binary_search(wanted.begin(), wanted.end(), t) != (*given)[t].empty();
  // Of another selection: it would keep more memory than the frame is counted for.
  if (!fits) given->clear();
  given->resize(body.tissues.size());
  for (const std::uint32_t t : wanted) (*given)[t].swap(body.tissues[t]);
  return given;
}

// Whether the arrays of this job's body are asked for by one frame alone, which may then keep them.
bool lone(const PoseJob& job) {
  std::size_t frames = 0;
  for (const Subscription& subscription : job.subscriptions) {
    for (std::size_t i = 0; i < subscription.streams.size(); ++i)
      frames += (subscription.levels >> i & 1) != 0 ? 1 : 0;
  }
  return frames == 1 && !job.digests;
}

// Of a plain frame that shows the rest pose, as all others of these tissues.
std::shared_ptr<const Positions> at_rest(const PoseJob& job, const Subscription& subscription,
                                         runtime::PosedBody& body) {
  if (subscription.rest) return subscription.rest;
  const MeshStream& stream = *subscription.streams.front();
  const std::vector<std::uint32_t>& wanted = stream.spec().tissues;
  if (auto shown = job.model->rest_pose.positions(wanted)) return shown;  // by this job
  std::shared_ptr<const Positions> shown;
  if (lone(job)) {
    shown = give(job, stream, body);
  } else {
    const auto copied = std::make_shared<Positions>(body.tissues.size());
    for (const std::uint32_t t : wanted) (*copied)[t] = body.tissues[t];
    shown = copied;
  }
  job.model->rest_pose.know(wanted, shown);
  return shown;
}

// Motions are few bytes, and the quality more than they: what was told before is told again now and then, for
// who missed it.
bool tells_quality(const PoseJob& job, const MeshStream& stream, const Judged& judged) {
  constexpr std::uint64_t again = 16;  // frames
  return !stream.spec().motions || judged.now || judged.quality->pose_sequence() == job.request.sequence ||
         job.number % again == 0;
}

PosedFrame mesh_frame(const PoseJob& job, const Subscription& subscription, std::size_t at,
                      runtime::PosedBody& body, const v1::ServerTimings& timings, const Judged& judged) {
  MeshStream& stream = *subscription.streams[at];
  v1::Envelope envelope;
  v1::MeshFrame& frame = *envelope.mutable_mesh_frame();
  frame.set_subscription(subscription.id);
  frame.set_frame(job.number);
  frame.set_pose_sequence(job.request.sequence);
  frame.set_topology_digest(job.model->opened.topology_digest());
  *frame.mutable_timings() = timings;
  if (tells_quality(job, stream, judged)) *frame.mutable_quality() = *judged.quality;
  if (stream.spec().motions) frame.set_skinning(skinning_to_proto(job.request.skinning));
  frame.mutable_timings()->set_measured(judged.took);
  for (const ClampedJoint& clamped : body.clamped) {
    describe(clamped, job.model->model().rig.skeleton, *frame.add_clamped());
  }
  if (stream.spec().pose) server::describe(job.request, *frame.mutable_pose());
  const auto start = Clock::now();
  wire::Pieces pieces;
  std::shared_ptr<wire::Payload> payload;
  if (stream.plain() && job.request.sequence == 0 && !job.digests) {
    pieces = stream.show(at_rest(job, subscription, body), frame);
  } else if (stream.plain() && lone(job)) {
    pieces = stream.show(give(job, stream, body), frame);
  } else {
    payload = job.model->payloads->take();
    const bool keyframe = (subscription.keyframes >> at & 1) != 0;
    if (!stream.write(body, true, keyframe, frame, *payload)) {
      static_cast<void>(pose(job, body, true));  // as good as the first time
      stream.write(body, false, keyframe, frame, *payload);
    }
  }
  frame.mutable_timings()->set_encoded(microseconds(Clock::now() - start));
  return {.subscription = subscription.id,
          .level = stream.level(),
          .number = job.number,
          .keyframe = frame.keyframe(),
          .encoded = frame.timings().encoded(),
          .bytes = job.memory->hold(payload ? wire::encode(envelope, payload)
                                            : wire::encode(envelope, std::move(pieces))),
          .judged = judged.now ? judged.quality : nullptr};
}

void send_back(const PoseJob& job, PosedFrame frame) {
  if (job.digests) frame.digest = digest_of(*frame.bytes);
  job.on_frame(std::move(frame));
}

// The frame says why there is no volume. `cancelled`: the job was stopped, and there is no frame.
Status show_volume(const PoseJob& job, const Subscription& subscription, const runtime::PosedBody& body,
                   const v1::ServerTimings& timings) {
  const auto start = Clock::now();
  v1::Envelope envelope;
  v1::VolumeFrame& frame = *envelope.mutable_volume_frame();
  frame.set_subscription(subscription.id);
  frame.set_frame(job.number);
  frame.set_pose_sequence(job.request.sequence);
  frame.set_volume(subscription.volume->spec().volume);
  const std::shared_ptr<wire::Payload> payload = subscription.volume->payload();
  Context context;
  context.stop = job.stop;
  Status status = guarded("pose", [&] {
    return subscription.volume->write({*job.model, job.hung, body}, job.volume_voxels,
                                      (subscription.keyframes & 1) != 0, frame, *payload, context);
  });
  if (status.code == StatusCode::cancelled) return status;
  if (!status.ok()) {
    payload->clear();
    frame.clear_grid();
    frame.clear_voxels();
    frame.clear_bricks();
    frame.clear_content();
    frame.clear_keyframe();
  }
  wire::to_proto(status, *frame.mutable_status());
  *frame.mutable_timings() = timings;
  frame.mutable_timings()->set_encoded(microseconds(Clock::now() - start));
  send_back(job, {.subscription = subscription.id,
                  .level = 0,
                  .number = job.number,
                  .keyframe = frame.keyframe(),
                  .encoded = frame.timings().encoded(),
                  .bytes = job.memory->hold(wire::encode(envelope, payload))});
  return {};
}

// Every frame of the posed body.
Status show(const PoseJob& job, runtime::PosedBody& body, const v1::ServerTimings& timings) {
  if (job.probe) {
    const runtime::Probe& probe = job.model->probe();
    probe.follow(body.scratch.lanes, job.probe->tree);
    if (job.probe_many) probe.fit(job.probe->tree);
    job.probe->sequence = job.request.sequence;
    job.on_probe();
  }
  // The streams that somebody wants a frame of.
  const auto wanted = [](const Subscription& subscription, std::size_t i) {
    return (subscription.levels >> i & 1) != 0;
  };
  for (const Subscription& subscription : job.subscriptions) {
    if (subscription.streams.empty()) continue;
    const Judged judged = judge(job, subscription, body);
    for (std::size_t i = 0; i < subscription.streams.size(); ++i) {
      if (wanted(subscription, i)) send_back(job, mesh_frame(job, subscription, i, body, timings, judged));
    }
  }
  for (const Subscription& subscription : job.subscriptions) {
    if (!subscription.volume) continue;
    if (Status status = show_volume(job, subscription, body, timings); !status.ok()) return status;
  }
  // Once everything is on its way.
  for (const Subscription& subscription : job.subscriptions) {
    for (std::size_t i = 0; i < subscription.streams.size(); ++i) {
      if (wanted(subscription, i)) subscription.streams[i]->settle(body);
    }
  }
  return {};
}

// Whether other threads could help: most of the time of a small job would go into waking them.
bool small(const PoseJob& job) {
  constexpr std::size_t most = 60'000;  // vertices, and nodes
  if (job.probe) return false;
  std::size_t work = nodes_wanted(job) == runtime::NodesOf::body ? job.model->model().node_count() : 0;
  for (const Subscription& subscription : job.subscriptions) {
    if (subscription.volume) return false;
    for (const std::uint32_t t : std::get<MeshSpec>(subscription.spec).tissues)
      work += static_cast<std::size_t>(job.model->model().tissues[t].V.rows());
  }
  return work <= most;
}

}  // namespace

Status run(const PoseJob& job) {
  if (job.stop.stop_requested()) return {StatusCode::cancelled, {}};  // where it waited long
  const auto start = Clock::now();
  PoseOutcome outcome;
  outcome.sequence = job.request.sequence;
  outcome.timings.set_waited(microseconds(start - job.request.arrived));
  BodyPool::Lease body;
  const auto pose_all = [&] {
    outcome.status = guarded("pose", [&] {
      body = (job.background ? job.model->background_bodies : job.model->bodies).take();
      return pose(job, *body);
    });
    outcome.timings.set_posed(microseconds(Clock::now() - start));
  };
  Status status;
  const auto all = [&] {
    pose_all();
    const v1::ServerTimings timings = outcome.timings;
    const bool posed = outcome.status.ok();
    status = guarded("pose", [&] {
      if (posed) outcome.clamped = body->clamped;
      job.on_outcome(std::move(outcome));
      return posed ? show(job, *body, timings) : Status{};
    });
  };
  if (job.serial || small(job)) {
    serially(all);
  } else {
    all();
  }
  return status;
}

}  // namespace ecorche::server
