// SPDX-License-Identifier: Apache-2.0
// One pose of one session, on a worker: the body is posed, then a frame is written for every subscription.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/probe.hpp>
#include <ecorche/wire/framing.hpp>
#include "runtime/server/net/asio.hpp"
#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/session/hung_spheres.hpp"
#include "runtime/server/session/served_model.hpp"
#include "runtime/server/session/subscription.hpp"

namespace ecorche::server {

struct PoseRequest {
  std::uint64_t sequence = 0;  ///< 0: the rest pose of a new session
  Pose pose;
  runtime::Skinning skinning = runtime::Skinning::cor;
  Clock::time_point arrived = Clock::now();
};

/// How the posing went; frames follow only where `status` is ok.
struct PoseOutcome {
  std::uint64_t sequence = 0;
  Status status;
  std::vector<ClampedJoint> clamped;
  v1::ServerTimings timings;
};

/// One frame, shared by every connection with that subscription.
struct PosedFrame {
  std::uint32_t subscription = 0;
  std::uint32_t level = 0;  ///< of detail
  std::uint64_t number = 0;
  std::uint64_t keyframe =
      0;                      ///< number of the frame that must have come before; 0: none; its own: it is one
  std::uint64_t encoded = 0;  ///< time that it took, microseconds
  std::shared_ptr<const wire::EncodedFrame> bytes;
  std::optional<std::uint64_t> digest = {};  ///< XXH64 of the payload, where PoseJob::digests asks for it
  std::shared_ptr<const v1::PoseQuality> judged = {};  ///< where it was measured with this frame
};

/// A posed body as probes ask it, any number of them at a time.
struct ProbeFrame {
  std::uint64_t sequence = 0;
  runtime::Probe::PosedTree tree;
  MemoryBudget::Reservation kept;  ///< its memory, counted
};

/// What a job shows.
struct ShownPose {
  PoseRequest request;
  std::uint64_t number = 0;  ///< of the frames
  bool volumes = false;      ///< the session's volumes, too
};

struct PoseJob {
  std::shared_ptr<const ServedModel> model;
  PoseRequest request;
  std::uint64_t number = 0;  ///< of the frames
  std::vector<Subscription> subscriptions;
  HungSpheres hung;
  std::uint64_t volume_voxels = 0;  ///< Limits
  runtime::QualityThresholds thresholds;
  bool judge = false;  ///< every frame with its own pose's quality; else Subscription::quality may be told
  bool digests = false;
  bool background = false;  ///< in a body of those that streams do not use
  bool serial = false;      ///< keeps to the calling thread, however large: the others are for streams
  bool volumes = false;     ///< the session's volumes are shown by this job, too
  std::stop_token stop;     ///< nobody wants its volumes any more
  const MemoryBudget* memory = nullptr;   ///< counts the frames
  MemoryBudget::Reservation reservation;  ///< about what they will take
  std::shared_ptr<ProbeFrame> probe;      ///< to be filled; null where nobody probes
  bool probe_many = false;  ///< points: the first must not wait until all is fitted that they see
  /// Called on the worker, in this order: the outcome once, `probe` once it is filled, then every frame,
  /// meshes before volumes (which take longer).
  std::function<void(PoseOutcome)> on_outcome;
  std::function<void()> on_probe;
  std::function<void(PosedFrame)> on_frame;
};

/// Throws nothing. The status is that of the frames: the first that could not be made (out of memory) while
/// the pose itself was good; `cancelled` where `stop` was asked for before the last volume was made, of which
/// no frame comes. A small job keeps to the calling thread.
Status run(const PoseJob& job);

}  // namespace ecorche::server
