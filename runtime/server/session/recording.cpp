// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/recording.hpp"

#include <algorithm>
#include <utility>

#include <ecorche/wire/convert.hpp>
#include "proto/recording.hpp"
#include "runtime/server/session/pose_state.hpp"

namespace ecorche::server {
namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kEndBytes = 64;  // the last frame's, kept free

// Whether a frame's bytes follow from the pose, and not from how soon the client took those before. (Frames
// against keyframes never come here.)
bool stands_alone(const v1::Subscribe& request) {
  return !request.mesh().adaptive();
}

}  // namespace

Recording::Recording(std::string name, const ServedModel& model, const std::string& server, std::size_t limit)
    : name_(std::move(name)), limit_(limit), rig_digest_(model.opened.rig_digest()) {
  v1::Envelope envelope;
  v1::RecordingHead& head = *envelope.mutable_recording_head();
  head.set_version(kVersion);
  head.set_model(model.opened.model());
  head.set_identity(model.opened.identity());
  head.set_rig_digest(model.opened.rig_digest());
  head.set_topology_digest(model.opened.topology_digest());
  head.set_server(server);
  append(envelope);
}

bool Recording::append(const v1::Envelope& envelope) {
  if (full_) return false;
  const std::string frame = wire::encode(envelope).head;
  full_ = taken_ + bytes_.size() + frame.size() + kEndBytes > limit_;
  if (!full_) bytes_ += frame;
  return !full_;
}

void Recording::add(const PoseRequest& pose) {
  v1::Envelope envelope;
  v1::RecordedPose& recorded = *envelope.mutable_recorded_pose();
  recorded.set_seconds(seconds(Clock::now() - start_));
  // Who opens a session that nobody controls may count anew; a file goes on.
  const std::uint64_t sequence = std::max(last_sequence_ + 1, pose.sequence);
  recorded.mutable_pose()->set_sequence(sequence);
  recorded.mutable_pose()->set_rig_digest(rig_digest_);
  recorded.mutable_pose()->set_skinning(skinning_to_proto(pose.skinning));
  wire::to_proto(pose.pose, *recorded.mutable_pose());
  mark_ = Mark{.bytes = bytes_.size(), .frames = frames_, .sequence = last_sequence_, .subscriptions = {}};
  if (!append(envelope)) return mark_.reset();
  ++poses_;
  last_sequence_ = sequence;
}

void Recording::add(const PosedFrame& frame, const v1::Subscribe& request) {
  if (!frame.digest || !mark_ || !stands_alone(request)) return;
  if (!subscriptions_.contains(frame.subscription)) {
    v1::Envelope envelope;
    envelope.mutable_recorded_subscription()->set_subscription(frame.subscription);
    *envelope.mutable_recorded_subscription()->mutable_subscribe() = request;
    mark_->subscriptions.push_back(frame.subscription);
    if (!append(envelope)) return take_back();
    subscriptions_.insert(frame.subscription);
  }
  v1::Envelope envelope;
  v1::RecordedFrame& recorded = *envelope.mutable_recorded_frame();
  recorded.set_subscription(frame.subscription);
  recorded.set_pose_sequence(last_sequence_);
  recorded.set_digest(*frame.digest);
  recorded.set_payload_bytes(frame.bytes->payload_bytes());
  if (!append(envelope)) return take_back();
  ++frames_;
}

void Recording::take_back() {
  if (!mark_) return;
  bytes_.resize(mark_->bytes);
  frames_ = mark_->frames;
  last_sequence_ = mark_->sequence;
  for (const std::uint32_t subscription : mark_->subscriptions) subscriptions_.erase(subscription);
  mark_.reset();
  --poses_;
}

std::string Recording::take() {
  if (poses_ == (mark_ ? 1U : 0U)) return {};
  const std::size_t size = mark_ ? mark_->bytes : bytes_.size();
  std::string out = bytes_.substr(0, size);
  bytes_.erase(0, size);
  taken_ += size;
  if (mark_) mark_->bytes = 0;
  return out;
}

void Recording::finish() {
  settle();
  v1::Envelope envelope;
  v1::RecordingEnd& end = *envelope.mutable_recording_end();
  end.set_poses(poses_);
  end.set_frames(frames_);
  end.set_full(full_);
  bytes_ += wire::encode(envelope).head;
}

Clip clip_of(std::span<const std::byte> file, const std::string& name, std::size_t segments) {
  Clip clip;
  clip.name = name;
  wire::RecordedSession session;
  if (!wire::read_recording(file, session).ok()) return clip;
  for (const wire::RecordedStep& step : session.steps) {
    Pose pose;
    if (!wire::from_proto(step.pose, segments, pose).ok()) break;
    clip.at.push_back(step.seconds - session.steps.front().seconds);
    clip.poses.push_back(std::move(pose));
  }
  const double steps = static_cast<double>(clip.at.size()) - 1;
  if (steps > 0 && clip.at.back() > 0) clip.last_seconds = clip.at.back() / steps;
  return clip;
}

std::uint64_t digest_of(const wire::EncodedFrame& frame) {
  return wire::payload_digest(frame.payload ? std::span<const std::byte>(*frame.payload)
                                            : std::span<const std::byte>());
}

}  // namespace ecorche::server
