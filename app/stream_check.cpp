// SPDX-License-Identifier: Apache-2.0
#include "app/stream_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <utility>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/wire/convert.hpp>
#include "proto/arrays.hpp"

namespace ecorche::app {
namespace {

constexpr std::size_t kLongestQueue = 8;
constexpr std::uint64_t kMostLines = 5;
constexpr double kFloatRounding = 4e-7;   // a few units in the last place
constexpr double kKernelRounding = 1e-3;  // mm
const double kWorstCosine = std::cos(1.01 * 3.14159265358979 / 180);

// How two arrays of positions differ, in words; empty where they agree. `step`: of the u16 encodings; 0: to
// the last bit.
std::string difference(std::span<const float> got, std::span<const float> expected, double step) {
  double worst = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    if (std::memcmp(&got[i], &expected[i], sizeof(float)) == 0) continue;
    const double off = std::abs(static_cast<double>(got[i]) - expected[i]);
    if (step > 0 && off <= step / 2 + kFloatRounding * std::abs(expected[i]) + kKernelRounding) continue;
    ++count;
    worst = std::max(worst, off);
  }
  if (count == 0) return {};
  char text[96];
  std::snprintf(text, sizeof text, "%zu of %zu coordinates differ, by %.3g mm at most", count, got.size(),
                worst);
  return text;
}

// Unit vectors against those of the kernels, in 32767ths; zeros must be zeros.
bool normals_agree(std::span<const float> got, std::span<const std::int16_t> expected) {
  for (std::size_t i = 0; i + 2 < got.size(); i += 3) {
    double cosine = 0;
    bool none = true;
    for (std::size_t c = 0; c < 3; ++c) {
      cosine += got[i + c] * expected[i + c] / 32767.0;
      none = none && expected[i + c] == 0;
    }
    if (none ? cosine != 0 : cosine < kWorstCosine) return false;
  }
  return true;
}

}  // namespace

StreamCheck::StreamCheck(std::shared_ptr<const Model> model, runtime::Skinning skinning,
                         runtime::Sampling sampling, std::function<void(std::string_view)> say)
    : poser_(std::move(model)),
      body_(poser_.make_frame({.positions = true, .quantised = false, .normals = true})),
      skinning_(skinning),
      sampling_(sampling),
      say_(std::move(say)),
      thread_([this] { work(); }) {}

StreamCheck::~StreamCheck() {
  finish();
}

void StreamCheck::add(wire::Frame frame, std::vector<wire::DecodedTissue> tissues, const Pose& pose) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return items_.size() < kLongestQueue; });
  items_.push_back({std::move(frame), std::move(tissues), pose});
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
                                  ? compare_mesh(envelope.mesh_frame(), item.tissues, item.pose)
                                  : compare_volume(envelope.volume_frame(), item.frame.payload, item.pose);
  return problem.empty() ? problem : "pose " + std::to_string(sequence) + ": " + problem;
}

std::string StreamCheck::compare_mesh(const v1::MeshFrame& frame,
                                      const std::vector<wire::DecodedTissue>& tissues, const Pose& pose) {
  std::vector<std::uint32_t> rows;
  for (const wire::DecodedTissue& tissue : tissues) rows.push_back(tissue.tissue);
  const auto& rest = poser_.model().tissues;
  if (rows.empty() || rows.back() >= rest.size()) return "its table of tissues is not that of the model";
  if (const Status status = poser_.run(pose, skinning_, rows, body_); !status.ok()) return status.message;
  const double step = frame.encoding() == v1::ENCODING_F32 ? 0 : frame.box().step();
  for (const wire::DecodedTissue& tissue : tissues) {
    const std::string name = "tissue '" + rest[tissue.tissue].name + "'";
    const std::vector<float>& expected = body_.tissues[tissue.tissue];
    if (tissue.positions.size() != expected.size())
      return name + " has " + std::to_string(tissue.positions.size() / 3) + " vertices";
    if (const std::string off = difference(tissue.positions, expected, step); !off.empty())
      return name + ": " + off;
    if (!normals_agree(tissue.normals, body_.normals[tissue.tissue])) return name + ": its normals differ";
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
