// SPDX-License-Identifier: Apache-2.0
// What a crowd makes of the frames that come to it.
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "bench/server/crowd_member.hpp"
#include "bench/server/walking.hpp"

namespace ecorche::bench {
namespace {

constexpr double kKernelRounding = 1e-3;  // mm; as app/stream_check

std::uint32_t load_u32(const char* p) {
  std::uint32_t value = 0;
  std::memcpy(&value, p, 4);
  return value;
}

}  // namespace

void Crowd::take(Member& member) {
  if (member.fd < 0) return;
  const ssize_t got = recv(member.fd, scratch_.data(), scratch_.size(), MSG_DONTWAIT);
  if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return fail(member, "the server hung up");
  std::size_t at = 0;
  const auto size = static_cast<std::size_t>(std::max<ssize_t>(got, 0));
  while (at < size && member.fd >= 0) {
    if (member.payload_left > 0) {
      const std::size_t n = std::min(member.payload_left, size - at);
      if (member.keeps)
        member.payload.insert(member.payload.end(), scratch_.begin() + static_cast<std::ptrdiff_t>(at),
                              scratch_.begin() + static_cast<std::ptrdiff_t>(at + n));
      at += n;
      member.payload_left -= n;
      if (member.payload_left == 0) arrive(member);
      continue;
    }
    const std::size_t want = (member.head_bytes == 0 ? 8 : member.head_bytes) - member.head.size();
    const std::size_t n = std::min(want, size - at);
    member.head.append(reinterpret_cast<const char*>(scratch_.data()) + at, n);
    at += n;
    if (n < want) continue;
    if (member.head_bytes == 0) {
      member.envelope_bytes = load_u32(member.head.data());
      member.payload_bytes = load_u32(member.head.data() + 4);
      member.head_bytes = wire::aligned(8 + member.envelope_bytes);
      continue;
    }
    finish_head(member);
  }
}

void Crowd::finish_head(Member& member) {
  if (!member.envelope.ParseFromArray(member.head.data() + 8, static_cast<int>(member.envelope_bytes)))
    return fail(member, "no envelope");
  member.head.clear();
  member.head_bytes = 0;
  member.payload_left = member.payload_bytes;
  const v1::Envelope& envelope = member.envelope;
  if (envelope.has_status() && envelope.status().code() != 0)
    return fail(member, envelope.status().message());
  if (envelope.has_goodbye()) return fail(member, envelope.goodbye().status().message());
  if (envelope.has_pose_ack() && envelope.pose_ack().status().code() != 0)
    return fail(member, envelope.pose_ack().status().message());
  member.keeps = false;
  if (envelope.has_mesh_frame()) {
    const v1::MeshFrame& frame = envelope.mesh_frame();
    const std::uint64_t each = member.options.check_each;
    ++member.seen;
    member.keeps = poser_ && each > 0 && (member.seen % each == 0 || frame.keyframe() == frame.frame());
    member.payload.clear();
    member.payload.reserve(member.keeps ? member.payload_bytes : 0);
  }
  if (member.payload_left == 0) arrive(member);
}

void Crowd::arrive(Member& member) {
  if (!member.envelope.has_mesh_frame()) return;
  const v1::MeshFrame& frame = member.envelope.mesh_frame();
  const auto now = Clock::now();
  v1::Envelope answer;
  answer.mutable_frame_ack()->set_subscription(frame.subscription());
  answer.mutable_frame_ack()->set_frame(frame.frame());
  member.say(wire::encode(answer).head);
  ++member.arrived.frames;
  if (member.last > 0 && frame.pose_sequence() > member.last)
    member.arrived.unseen += frame.pose_sequence() - member.last - 1;
  member.last = frame.pose_sequence();
  member.arrived.bytes += member.payload_bytes;
  member.arrived.posed_ms.push_back(static_cast<double>(frame.timings().posed()) / 1e3);
  member.arrived.encoded_ms.push_back(static_cast<double>(frame.timings().encoded()) / 1e3);
  if (!frame.has_quality()) ++member.arrived.unjudged;
  member.arrived.judged_ago.push_back(
      static_cast<double>(frame.pose_sequence() - frame.quality().pose_sequence()));
  if (const Clock::time_point* sent = member.times->find(frame.pose_sequence()))
    member.arrived.ms.push_back(std::chrono::duration<double, std::milli>(now - *sent).count());
  if (member.keeps) member.held.push_back({frame, std::exchange(member.payload, {})});
}

void Crowd::check() {
  for (const auto& member : members_) {
    if (!member) continue;
    for (const Held& held : std::exchange(member->held, {})) check(*member, held);
  }
}

// Decodes, and compares with offline posing: every vertex within the encoding's bound, float32 to the bit.
void Crowd::check(Member& member, const Held& held) {
  const v1::MeshFrame& frame = held.frame;
  ++member.arrived.checked;
  if (!member.decoder.decode(frame, held.payload, member.decoded).ok()) return void(++member.arrived.wrong);
  std::vector<std::uint32_t> rows;
  for (const wire::DecodedTissue& tissue : member.decoded) rows.push_back(tissue.tissue);
  Pose pose = Pose::rest(rig_.skeleton.segments.size());
  if (frame.pose_sequence() > 0) {
    pose = walking(rig_, static_cast<double>(frame.pose_sequence() % kStride) / kStride);
    pose.root_translation = place_of(member.options, frame.pose_sequence());
  }
  bool right = poser_->run(pose, runtime::Skinning::cor, rows, body_, runtime::NodesOf::tissues).ok();
  const double bound = frame.encoding() == v1::ENCODING_F32 ? 0 : frame.box().step() / 2 + kKernelRounding;
  for (const wire::DecodedTissue& tissue : member.decoded) {
    const std::vector<float>& expected = body_.tissues[tissue.tissue];
    right = right && tissue.positions.size() == expected.size();
    for (std::size_t i = 0; right && i < expected.size(); ++i) {
      const double off =
          std::abs(static_cast<double>(tissue.positions[i]) - static_cast<double>(expected[i]));
      right = off <= bound + (bound > 0 ? 4e-7 * std::abs(static_cast<double>(expected[i])) : 0);
    }
  }
  member.arrived.wrong += right ? 0 : 1;
}

}  // namespace ecorche::bench
