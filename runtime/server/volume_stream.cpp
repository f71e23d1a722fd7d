// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/volume_stream.hpp"

#include <zstd.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "proto/arrays.hpp"
#include "proto/convert.hpp"
#include "runtime/spheres/slice.hpp"

namespace ecorche::server {
namespace {

// Faster than the network; the next levels give a tenth for twice the time.
constexpr int kZstdLevel = 1;

Status check_size(const ImageGrid& grid, std::uint64_t most) {
  if (grid.voxels() <= most) return {};
  return {StatusCode::resource_exhausted, "volume: the posed grid has " + std::to_string(grid.voxels()) +
                                              " voxels (at most " + std::to_string(most) +
                                              "; keep the body nearer to the scan)"};
}

// The voxels of a brick, i fastest.
void append_brick(const Image& image, const runtime::VoxelRange& range, std::vector<std::byte>& out) {
  const std::size_t voxel = scalar_bytes(image.type) * static_cast<std::size_t>(image.components);
  const auto run = static_cast<std::size_t>(range.last[0] - range.first[0] + 1) * voxel;
  for (std::int32_t k = range.first[2]; k <= range.last[2]; ++k) {
    for (std::int32_t j = range.first[1]; j <= range.last[1]; ++j) {
      const std::byte* from = image.bytes.data() + image.grid.offset(range.first[0], j, k) * voxel;
      out.insert(out.end(), from, from + run);
    }
  }
}

}  // namespace

Status VolumeStream::write(const ServedModel& served, const runtime::PosedBody& body,
                           std::uint64_t most_voxels, bool keyframe, v1::VolumeFrame& frame,
                           wire::Payload& payload) {
  payload.clear();
  if (!want_.slices.empty()) {
    write_slices(served, body, frame, payload);
    return {};
  }
  Status status =
      want_.by_spheres ? by_spheres(served, body, most_voxels) : by_tets(served, body, most_voxels);
  if (!status.ok()) return status;
  wire::to_proto(posed_.image->grid, *frame.mutable_grid());
  if (want_.changed_bricks) {
    write_bricks(keyframe, frame, payload);
  } else {
    put(posed_.image->bytes, *posed_.image, frame, payload);
  }
  return {};
}

Status VolumeStream::by_tets(const ServedModel& served, const runtime::PosedBody& body,
                             std::uint64_t most_voxels) {
  const ModelVolume& volume = served.model().volumes[want_.volume];
  const ImageGrid& rest = volume.image.grid;
  const ImageGrid grid = want_.region
                             ? grid_of(rest, runtime::box_within(rest, want_.region->low, want_.region->high))
                             : runtime::grow_to(rest, body.nodes);
  if (Status status = check_size(grid, most_voxels); !status.ok()) return status;
  served.volumes().follow(body.nodes, volume, want_.sampling, grid, kept_, scratch_);
  posed_ = {&kept_.image, &kept_.bricks, &kept_.moved};
  return {};
}

Status VolumeStream::by_spheres(const ServedModel& served, const runtime::PosedBody& body,
                                std::uint64_t most_voxels) {
  runtime::BallSet set = served.balls(want_.volume).at(body.segments);
  const runtime::LatticeBox box = runtime::box_for(set, want_.region);
  if (Status status = check_size(grid_of(set.lattice, box), most_voxels); !status.ok()) return status;
  runtime::follow(std::move(set), box, served.model().volumes[want_.volume], want_.sampling, refilled_);
  posed_ = {&refilled_.image, &refilled_.bricks, &refilled_.moved};
  return {};
}

void VolumeStream::write_slices(const ServedModel& served, const runtime::PosedBody& body,
                                v1::VolumeFrame& frame, wire::Payload& payload) {
  const ModelVolume& volume = served.model().volumes[want_.volume];
  std::optional<runtime::BallSet> set;
  if (want_.by_spheres) set = served.balls(want_.volume).at(body.segments);
  std::vector<std::byte> pixels;
  for (const ImageGrid& plane : want_.slices) {
    if (set) {
      slice_ = Image(plane, volume.image.type, volume.image.components);
      runtime::refill_slice(*set, volume.image, volume.background, want_.sampling, slice_);
    } else {
      served.volumes().pose(body.nodes, volume, want_.sampling, plane, slice_, scratch_);
    }
    pixels.insert(pixels.end(), slice_.bytes.begin(), slice_.bytes.end());
  }
  put(pixels, slice_, frame, payload);
}

void VolumeStream::write_bricks(bool keyframe, v1::VolumeFrame& frame, wire::Payload& payload) {
  const Image& image = *posed_.image;
  const std::vector<std::uint8_t>& moved = *posed_.moved;
  if (image.grid != keyframe_grid_ || changed_.size() != moved.size()) keyframe = true;
  if (!keyframe) {
    for (std::size_t b = 0; b < changed_.size(); ++b) changed_[b] |= moved[b];
  }
  // Three quarters of the bricks: another keyframe pays.
  const auto changed = static_cast<std::size_t>(std::count(changed_.begin(), changed_.end(), 1));
  if (keyframe || keyframe_ == 0 || frame.frame() - keyframe_ >= keyframe_interval ||
      4 * changed > 3 * changed_.size()) {
    keyframe_ = frame.frame();
    keyframe_grid_ = image.grid;
    changed_.assign(moved.size(), 0);
    frame.set_keyframe(keyframe_);
    put(image.bytes, image, frame, payload);
    return;
  }
  frame.set_keyframe(keyframe_);
  std::vector<std::uint32_t> bricks;
  std::vector<std::byte> voxels;
  for (std::uint32_t b = 0; b < changed_.size(); ++b) {
    if (changed_[b] == 0) continue;
    bricks.push_back(b);
    append_brick(image, posed_.bricks->voxels(b, image.grid), voxels);
  }
  *frame.mutable_bricks() = wire::append(payload, std::span<const std::uint32_t>(bricks), 1);
  put(voxels, image, frame, payload);
}

void VolumeStream::put(std::span<const std::byte> voxels, const Image& like, v1::VolumeFrame& frame,
                       wire::Payload& payload) const {
  const auto components = static_cast<std::uint32_t>(like.components);
  if (!want_.compressed) {
    *frame.mutable_voxels() = wire::append(payload, voxels, like.type, components);
    return;
  }
  v1::Array& content = *frame.mutable_content();
  content.set_type(wire::to_proto(like.type));
  content.set_components(components);
  content.set_count(voxels.size() / scalar_bytes(like.type) / components);
  std::vector<std::byte> packed(ZSTD_compressBound(voxels.size()));
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), voxels.data(), voxels.size(), kZstdLevel);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();  // the bound holds: nothing else can be wrong
  packed.resize(size);
  *frame.mutable_voxels() = wire::append(payload, packed, ScalarType::u8, 1);
}

}  // namespace ecorche::server
