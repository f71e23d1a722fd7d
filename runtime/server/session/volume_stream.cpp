// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/volume_stream.hpp"

#include <zstd.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include <ecorche/wire/convert.hpp>
#include "proto/arrays.hpp"
#include "runtime/server/session/retained_bytes.hpp"
#include "runtime/spheres/slice.hpp"

namespace ecorche::server {
namespace {

// Faster than the network; the next levels give a tenth for twice the time.
constexpr int kZstdLevel = 1;

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

Status VolumeStream::write(const Shown& shown, std::uint64_t most_voxels, bool keyframe,
                           v1::VolumeFrame& frame, wire::Payload& payload, const Context& context) {
  payload.clear();
  // Until it is whole: what moved meanwhile would be forgotten.
  const std::uint64_t last_keyframe = std::exchange(keyframe_, 0);
  if (!spec_.slices.empty()) {
    write_slices(shown, frame, payload, context);
    return {};
  }
  const Bounds bounds{most_voxels, context};
  if (Status status = spec_.by_spheres ? by_spheres(shown, bounds) : by_tets(shown, bounds); !status.ok())
    return status;
  wire::to_proto(posed_.image->grid, *frame.mutable_grid());
  if (spec_.changed_bricks) {
    write_bricks(keyframe, last_keyframe, frame, payload);
  } else {
    put(posed_.image->bytes, *posed_.image, frame, payload);
  }
  return {};
}

// A body that is carried far away makes the lattice of every stream grow: what they grew by is
// counted.
Status VolumeStream::reserve(const Model& model, const ImageGrid& grid, const Bounds& bounds) {
  const std::uint64_t voxels = grid.voxels();
  if (voxels > bounds.most_voxels) {
    return {StatusCode::resource_exhausted, "volume: the posed grid has " + std::to_string(voxels) +
                                                " voxels (at most " + std::to_string(bounds.most_voxels) +
                                                "; keep the body nearer to the scan)"};
  }
  const std::uint64_t beyond =
      kept_by(model, spec_, std::max(voxels, at_rest_)) - kept_by(model, spec_, at_rest_);
  if (pool_ && beyond > beyond_ && pool_->full(beyond - beyond_)) {
    return {StatusCode::resource_exhausted,
            "volume: posed grids fill the server's memory for streams (keep the body nearer to the scan)"};
  }
  if (pool_ && beyond != beyond_) held_ = MemoryBudget::Reservation(pool_, beyond);
  beyond_ = beyond;
  return {};
}

Status VolumeStream::by_tets(const Shown& shown, const Bounds& bounds) {
  const auto& [served, hung, body] = shown;
  const ModelVolume& volume = served.model().volumes[spec_.volume];
  const ImageGrid& rest = volume.image.grid;
  const ImageGrid grid = spec_.region
                             ? grid_of(rest, runtime::box_within(rest, spec_.region->low, spec_.region->high))
                             : runtime::grow_to(rest, body.nodes);
  if (Status status = reserve(served.model(), grid, bounds); !status.ok()) return status;
  served.volumes().follow(body.nodes, volume, spec_.sampling, grid, kept_,
                          served.volume_scratch->take()->tets, bounds.context);
  posed_ = {&kept_.image, &kept_.bricks, &kept_.moved};
  return {};
}

Status VolumeStream::by_spheres(const Shown& shown, const Bounds& bounds) {
  const auto& [served, hung, body] = shown;
  const ModelVolume& volume = served.model().volumes[spec_.volume];
  runtime::BallSet set = hung.balls(served, spec_.volume).at(body.segments);
  const runtime::LatticeBox box = runtime::box_for(set, spec_.region);
  if (Status status = reserve(served.model(), grid_of(set.lattice, box), bounds); !status.ok()) return status;
  runtime::follow(std::move(set), box, volume, spec_.sampling, refilled_, bounds.context);
  posed_ = {&refilled_.image, &refilled_.bricks, &refilled_.moved};
  return {};
}

void VolumeStream::write_slices(const Shown& shown, v1::VolumeFrame& frame, wire::Payload& payload,
                                const Context& context) {
  const auto& [served, hung, body] = shown;
  const ModelVolume& volume = served.model().volumes[spec_.volume];
  std::optional<runtime::BallSet> set;
  if (spec_.by_spheres) set = hung.balls(served, spec_.volume).at(body.segments);
  const std::shared_ptr<VolumeScratch> scratch = served.volume_scratch->take();
  Image& slice = scratch->slice;
  const std::size_t pixel =
      scalar_bytes(volume.image.type) * static_cast<std::size_t>(volume.image.components);
  std::size_t pixels = 0;
  for (const ImageGrid& plane : spec_.slices) pixels += plane.voxels();
  // Where they stay: grown, or copied once more, hundreds of MiB would be there twice.
  std::vector<std::byte> packed;
  if (spec_.compressed) packed.reserve(pixels * pixel);
  const auto components = static_cast<std::uint32_t>(volume.image.components);
  v1::Array& array = *frame.mutable_voxels();
  if (!spec_.compressed) {
    payload.reserve((pixels * pixel + 15) / 16 * 16);
    array = wire::append(payload, std::span<const std::byte>(), volume.image.type, components);
    array.set_count(pixels);
  }
  for (const ImageGrid& plane : spec_.slices) {
    if (set) {
      slice = Image(plane, volume.image.type, volume.image.components);
      runtime::refill_slice(*set, volume.image, volume.background, spec_.sampling, slice, context);
    } else {
      served.volumes().pose(body.nodes, volume, spec_.sampling, plane, slice, scratch->tets, context);
    }
    if (spec_.compressed) {
      packed.insert(packed.end(), slice.bytes.begin(), slice.bytes.end());
    } else {
      payload.insert(payload.end(), slice.bytes.begin(), slice.bytes.end());
    }
  }
  if (spec_.compressed) return put(packed, slice, frame, payload);
  payload.resize((payload.size() + 15) / 16 * 16);
}

void VolumeStream::write_bricks(bool keyframe, std::uint64_t last_keyframe, v1::VolumeFrame& frame,
                                wire::Payload& payload) {
  const Image& image = *posed_.image;
  const std::vector<std::uint8_t>& moved = *posed_.moved;
  if (image.grid != keyframe_grid_ || changed_.size() != moved.size()) keyframe = true;
  if (!keyframe) {
    for (std::size_t b = 0; b < changed_.size(); ++b) changed_[b] |= moved[b];
  }
  // Three quarters of the bricks: another keyframe pays.
  const auto changed = static_cast<std::size_t>(std::count(changed_.begin(), changed_.end(), 1));
  if (keyframe || last_keyframe == 0 || frame.frame() - last_keyframe >= keyframe_interval ||
      4 * changed > 3 * changed_.size()) {
    frame.set_keyframe(frame.frame());
    put(image.bytes, image, frame, payload);
    keyframe_grid_ = image.grid;
    changed_.assign(moved.size(), 0);
    keyframe_ = frame.frame();
    return;
  }
  frame.set_keyframe(last_keyframe);
  std::vector<std::uint32_t> bricks;
  std::vector<std::byte> voxels;
  for (std::uint32_t b = 0; b < changed_.size(); ++b) {
    if (changed_[b] == 0) continue;
    bricks.push_back(b);
    append_brick(image, posed_.bricks->voxels(b, image.grid), voxels);
  }
  *frame.mutable_bricks() = wire::append(payload, std::span<const std::uint32_t>(bricks), 1);
  put(voxels, image, frame, payload);
  keyframe_ = last_keyframe;
}

void VolumeStream::put(std::span<const std::byte> voxels, const Image& like, v1::VolumeFrame& frame,
                       wire::Payload& payload) const {
  const auto components = static_cast<std::uint32_t>(like.components);
  if (!spec_.compressed) {
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
