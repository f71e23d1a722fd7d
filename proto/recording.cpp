// SPDX-License-Identifier: Apache-2.0
#include "proto/recording.hpp"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include <ecorche/wire/framing.hpp>

namespace ecorche::wire {
namespace {

// A pose of a large rig takes some KiB.
constexpr FrameLimits kLimits{.envelope_bytes = 1 << 20, .payload_bytes = 0};
constexpr std::uint32_t kVersion = 1;

Status broken(const std::string& what) {
  return {StatusCode::invalid_argument, "recording: " + what + " (record it again)"};
}

class Reader {
 public:
  explicit Reader(RecordedSession& out) : out_(out) {}

  bool ended() const { return ended_; }

  Status take(v1::Envelope& envelope) {
    if (ended_) return broken("something follows its end");
    if (begun_ == envelope.has_recording_head()) return broken("its head is not at the start, once");
    switch (envelope.message_case()) {
      case v1::Envelope::kRecordingHead:
        return take_head(*envelope.mutable_recording_head());
      case v1::Envelope::kRecordedSubscription: {
        auto& told = *envelope.mutable_recorded_subscription();
        const bool fresh =
            out_.subscriptions.emplace(told.subscription(), std::move(*told.mutable_subscribe())).second;
        return fresh ? Status{} : broken("a subscription is told twice");
      }
      case v1::Envelope::kRecordedPose:
        return take_pose(*envelope.mutable_recorded_pose());
      case v1::Envelope::kRecordedFrame:
        return take_frame(envelope.recorded_frame());
      case v1::Envelope::kRecordingEnd:
        ended_ = true;
        out_.full = envelope.recording_end().full();
        if (envelope.recording_end().poses() != out_.steps.size() ||
            envelope.recording_end().frames() != frames_)
          return broken("its end counts other poses or frames");
        return {};
      default:
        return broken("message " + std::to_string(envelope.message_case()) + " does not belong into it");
    }
  }

 private:
  Status take_head(v1::RecordingHead& head) {
    begun_ = true;
    if (head.version() != kVersion) {
      return {StatusCode::unimplemented, "recording: it is of version " + std::to_string(head.version()) +
                                             " (read it with a newer ecorche)"};
    }
    out_.head = std::move(head);
    return {};
  }

  Status take_pose(v1::RecordedPose& pose) {
    if (pose.pose().sequence() <= last_ || !std::isfinite(pose.seconds()) || pose.seconds() < seconds_)
      return broken("its poses are not in order");
    last_ = pose.pose().sequence();
    seconds_ = pose.seconds();
    out_.steps.push_back({.seconds = seconds_, .pose = std::move(*pose.mutable_pose()), .frames = {}});
    return {};
  }

  Status take_frame(const v1::RecordedFrame& frame) {
    if (last_ == 0 || frame.pose_sequence() != last_ || !out_.subscriptions.contains(frame.subscription()))
      return broken("a frame of a pose or a subscription that was not told");
    out_.steps.back().frames.push_back(frame);
    ++frames_;
    return {};
  }

  RecordedSession& out_;
  bool begun_ = false, ended_ = false;
  std::uint64_t last_ = 0, frames_ = 0;
  double seconds_ = 0;
};

}  // namespace

Status read_recording(std::span<const std::byte> file, RecordedSession& out) {
  out = {};
  Reader reader(out);
  FrameReader frames(kLimits);
  while (!file.empty()) {
    const std::span<std::byte> into = frames.prepare();
    const std::size_t n = std::min(into.size(), file.size());
    std::memcpy(into.data(), file.data(), n);
    file = file.subspan(n);
    if (const Status status = frames.commit(n); !status.ok()) return broken(status.message);
    if (!frames.complete()) continue;
    Frame frame = frames.release();
    if (Status status = reader.take(frame.envelope); !status.ok()) return status;
  }
  if (!reader.ended() || !frames.between_frames())
    return {StatusCode::data_loss, "recording: it was cut (copy it again)"};
  return {};
}

std::uint64_t payload_digest(std::span<const std::byte> payload) {
  return XXH64(payload.data(), payload.size(), 0);
}

}  // namespace ecorche::wire
