// SPDX-License-Identifier: Apache-2.0
#include "app/stream_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <utility>

#include "core/model_file/model_file.hpp"
#include "proto/arrays.hpp"
#include "proto/convert.hpp"

namespace ecorche::app {
namespace {

constexpr std::size_t kLongestQueue = 8;
constexpr std::uint64_t kMostLines = 5;

// How two arrays of positions differ, in words.
std::string difference(std::span<const float> got, std::span<const float> expected) {
  double worst = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    if (std::memcmp(&got[i], &expected[i], sizeof(float)) == 0) continue;
    ++count;
    worst = std::max(worst, std::abs(static_cast<double>(got[i]) - expected[i]));
  }
  char text[96];
  std::snprintf(text, sizeof text, "%zu of %zu coordinates differ, by %.3g mm at most", count, got.size(),
                worst);
  return text;
}

}  // namespace

StreamCheck::StreamCheck(std::shared_ptr<const Model> model, runtime::Skinning skinning,
                         runtime::Sampling sampling, std::function<void(std::string_view)> say)
    : poser_(std::move(model)),
      body_(poser_.make_frame()),
      skinning_(skinning),
      sampling_(sampling),
      say_(std::move(say)),
      thread_([this] { work(); }) {}

StreamCheck::~StreamCheck() {
  finish();
}

void StreamCheck::add(wire::Frame frame, const Pose& pose) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return items_.size() < kLongestQueue; });
  items_.push_back({std::move(frame), pose});
  changed_.notify_all();
}

StreamCheck::Result StreamCheck::finish() {
  {
    const std::lock_guard lock(mutex_);
    finished_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  return result_;
}

void StreamCheck::work() {
  while (true) {
    Item item;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return finished_ || !items_.empty(); });
      if (items_.empty()) return;
      item = std::move(items_.front());
      items_.pop_front();
    }
    changed_.notify_all();
    std::string problem;
    try {
      problem = compare(item);
    } catch (const std::exception& error) {
      problem = error.what();
    }
    ++result_.checked;
    if (problem.empty()) continue;
    if (++result_.mismatches <= kMostLines) say_("mismatch: " + problem);
  }
}

std::string StreamCheck::compare(const Item& item) {
  const v1::Envelope& envelope = item.frame.envelope;
  const std::uint64_t sequence = envelope.has_mesh_frame() ? envelope.mesh_frame().pose_sequence()
                                                           : envelope.volume_frame().pose_sequence();
  const std::string problem = envelope.has_mesh_frame()
                                  ? compare_mesh(envelope.mesh_frame(), item.frame.payload, item.pose)
                                  : compare_volume(envelope.volume_frame(), item.frame.payload, item.pose);
  return problem.empty() ? problem : "pose " + std::to_string(sequence) + ": " + problem;
}

std::string StreamCheck::compare_mesh(const v1::MeshFrame& frame, const wire::Payload& payload,
                                      const Pose& pose) {
  std::vector<std::uint32_t> tissues;
  for (const v1::MeshArray& array : frame.arrays()) tissues.push_back(array.tissue());
  const auto& rest = poser_.model().tissues;
  if (tissues.empty() || tissues.back() >= rest.size() || !std::is_sorted(tissues.begin(), tissues.end())) {
    return "its table of tissues is not that of the model";
  }
  if (const Status status = poser_.run(pose, skinning_, tissues, body_); !status.ok()) return status.message;
  for (const v1::MeshArray& array : frame.arrays()) {
    const std::string& name = rest[array.tissue()].name;
    std::span<const float> got;
    if (array.kind() != v1::MeshArray::KIND_POSITIONS || !wire::find(array.array(), payload, 3, got)) {
      return "tissue '" + name + "' has no readable positions";
    }
    const std::vector<float>& expected = body_.tissues[array.tissue()];
    if (got.size() != expected.size())
      return "tissue '" + name + "' has " + std::to_string(got.size() / 3) + " vertices";
    if (std::memcmp(got.data(), expected.data(), got.size_bytes()) != 0)
      return "tissue '" + name + "': " + difference(got, expected);
  }
  return {};
}

std::string StreamCheck::compare_volume(const v1::VolumeFrame& frame, const wire::Payload& payload,
                                        const Pose& pose) {
  if (frame.status().code() != 0) return frame.status().message();
  const auto& volumes = poser_.model().volumes;
  if (frame.volume() >= volumes.size())
    return "volume " + std::to_string(frame.volume()) + " is not in the model";
  const ModelVolume& volume = volumes[frame.volume()];
  if (const Status status = poser_.run(pose, skinning_, {}, body_); !status.ok()) return status.message;
  const ImageGrid grid = runtime::grow_to(volume.image.grid, body_.nodes);
  ImageGrid sent;
  if (const Status status = wire::from_proto(frame.grid(), sent); !status.ok()) return status.message;
  if (sent != grid) return "volume '" + volume.name + "' lies on another grid";
  const Image expected = runtime::pose_volume(poser_.shared_model(), body_.nodes, volume, sampling_, grid);
  std::span<const std::byte> got;
  if (!wire::find(frame.voxels(), payload, got) || frame.voxels().type() != wire::to_proto(expected.type)) {
    return "volume '" + volume.name + "' has no readable voxels";
  }
  const bool same =
      got.size() == expected.bytes.size() && std::memcmp(got.data(), expected.bytes.data(), got.size()) == 0;
  return same ? std::string() : "volume '" + volume.name + "': its voxels differ";
}

}  // namespace ecorche::app
