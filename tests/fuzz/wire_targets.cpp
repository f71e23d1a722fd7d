// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

#include <ecorche/wire/convert.hpp>
#include <ecorche/wire/framing.hpp>
#include <ecorche/wire/mesh_decoder.hpp>
#include <ecorche/wire/volume_decoder.hpp>
#include "proto/arrays.hpp"
#include "proto/recording.hpp"
#include "tests/fuzz/peak_bytes.hpp"
#include "tests/fuzz/promises.hpp"
#include "tests/fuzz/targets.hpp"

namespace ecorche::fuzz {
namespace {

void look_at(const v1::Array& array, const wire::Payload& payload) {
  std::span<const std::byte> found;
  if (!wire::find(array, payload, found)) return;
  must(found.empty() || (found.data() >= payload.data() && found.size() <= payload.size()));
}

void look_at(const wire::Frame& frame) {
  const v1::Envelope& envelope = frame.envelope;
  for (const v1::Tissue& tissue : envelope.model_opened().tissues())
    look_at(tissue.triangles(), frame.payload);
  for (const v1::MeshArray& array : envelope.mesh_frame().arrays()) look_at(array.array(), frame.payload);
  look_at(envelope.volume_frame().voxels(), frame.payload);
  look_at(envelope.probe_points().points(), frame.payload);
  look_at(envelope.probed().points(), frame.payload);

  Rig rig;
  const bool posable = wire::from_proto(envelope.model_opened().skeleton(), rig).ok();
  if (posable) {
    for (std::size_t i = 0; i < rig.skeleton.segments.size(); ++i)
      must(rig.skeleton.segments[i].parent < static_cast<int>(i));
  }
  ImageGrid grid;
  if (wire::from_proto(envelope.volume_frame().grid(), grid).ok()) {
    for (const auto size : grid.size) must(size >= 0);
  }
  Pose pose;
  const v1::PoseUpdate& update = envelope.pose_update();
  const std::size_t joints = static_cast<std::size_t>(update.rotation_size()) / 4;
  if (!wire::from_proto(update, joints, pose).ok()) return;
  must(pose.rotation.size() == joints);
  for (const auto& turn : pose.rotation) must(std::abs(turn.norm() - 1) < 0.01);
  v1::PoseUpdate again;
  wire::to_proto(pose, again);
  Pose same;
  must(wire::from_proto(again, joints, same).ok());
}

}  // namespace

void framing(Bytes bytes) {
  if (bytes.empty()) return;
  const std::size_t piece = 1 + std::to_integer<std::size_t>(bytes[0]);
  bytes = bytes.subspan(1);
  wire::FrameReader reader(kFrameLimits);
  std::size_t read = 0, written = 0;
  while (!bytes.empty()) {
    const auto into = reader.prepare();
    const std::size_t n = std::min({into.size(), bytes.size(), piece});
    must(n > 0);
    std::memcpy(into.data(), bytes.data(), n);
    bytes = bytes.subspan(n);
    read += n;
    if (!reader.commit(n).ok()) return;
    if (!reader.complete()) continue;
    const wire::Frame frame = reader.release();
    must(reader.between_frames());
    look_at(frame);
    // What came whole can be sent again; Protobuf may write it shorter.
    const auto payload = std::make_shared<const wire::Payload>(frame.payload);
    if (frame.envelope.ByteSizeLong() > 0) written += wire::encode(frame.envelope, payload).bytes();
  }
  must(written <= read + 16 || read > 0);
}

void messages(Bytes bytes) {
  if (bytes.empty()) return;
  // The first byte: so many sixteens of payload follow the message.
  const std::size_t size =
      std::min(16 * std::to_integer<std::size_t>(bytes[0]), (bytes.size() - 1) / 16 * 16);
  wire::Frame frame;
  const Bytes envelope = bytes.subspan(1, bytes.size() - 1 - size);
  if (!frame.envelope.ParseFromArray(envelope.data(), static_cast<int>(envelope.size()))) return;
  frame.payload.assign(bytes.end() - static_cast<std::ptrdiff_t>(size), bytes.end());
  look_at(frame);
}

namespace {

// What frames of a few KiB may take: what the limits let a frame declare, and of messages that are all tags
// what Protobuf makes of them.
void must_stay_small(Bytes bytes, std::int64_t declared, const std::function<void()>& work) {
  constexpr std::int64_t kBeside = 1 << 17, kPerByte = 128;
  must(peak_bytes(work) <= kBeside + declared + kPerByte * static_cast<std::int64_t>(bytes.size()));
}

// Every frame of the bytes, up to the first that is none.
template <class Look>
void each_frame(Bytes bytes, Look&& look) {
  wire::FrameReader reader(kFrameLimits);
  while (!bytes.empty()) {
    const auto into = reader.prepare();
    const std::size_t n = std::min(into.size(), bytes.size());
    std::memcpy(into.data(), bytes.data(), n);
    bytes = bytes.subspan(n);
    if (!reader.commit(n).ok()) return;
    if (reader.complete()) look(reader.release());
  }
}

}  // namespace

void meshes(Bytes bytes) {
  must_stay_small(bytes, kFrameLimits.envelope_bytes + kFrameLimits.payload_bytes, [&] {
    wire::MeshDecoder decoder;
    std::vector<wire::DecodedTissue> tissues;
    each_frame(bytes, [&](const wire::Frame& frame) {
      const v1::MeshFrame& mesh = frame.envelope.mesh_frame();
      if (!decoder.decode(mesh, frame.payload, tissues).ok()) return;
      must(tissues.size() <= static_cast<std::size_t>(mesh.arrays_size()));
      for (std::size_t t = 0; t < tissues.size(); ++t) {
        const wire::DecodedTissue& tissue = tissues[t];
        must(t == 0 || tissues[t - 1].tissue < tissue.tissue);
        must(tissue.positions.size() % 3 == 0);
        must(tissue.normals.empty() || tissue.normals.size() == tissue.positions.size());
        must(tissue.numbers.size() == (mesh.encoding() == v1::ENCODING_F32 ? 0 : tissue.positions.size()));
        for (const float x : tissue.normals) must(std::abs(x) <= 1.001F);
      }
    });
  });
}

void volumes(Bytes bytes) {
  wire::VolumeDecoder decoder;
  Image image;
  each_frame(bytes, [&](const wire::Frame& frame) {
    const v1::VolumeFrame& volume = frame.envelope.volume_frame();
    if (!decoder.decode(volume, frame.payload, image).ok()) return;
    const std::size_t voxel = scalar_bytes(image.type) * static_cast<std::size_t>(image.components);
    must(image.bytes.size() == image.grid.voxels() * voxel);
  });
}

void recording(Bytes bytes) {
  must_stay_small(bytes, 1 << 20, [&] {
    wire::RecordedSession session;
    if (!wire::read_recording(bytes, session).ok()) return;
    std::uint64_t last = 0;
    for (const wire::RecordedStep& step : session.steps) {
      must(step.pose.sequence() > last);
      last = step.pose.sequence();
      for (const v1::RecordedFrame& frame : step.frames)
        must(session.subscriptions.contains(frame.subscription()));
    }
  });
}

}  // namespace ecorche::fuzz
