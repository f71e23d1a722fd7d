// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/volume_decoder.hpp>

#include <zstd.h>

#include <algorithm>
#include <string>
#include <vector>

#include <ecorche/wire/convert.hpp>
#include "proto/arrays.hpp"

namespace ecorche::wire {
namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 33;
// A block of zstd that repeats one byte: 128 KiB out of 4 bytes. More than that nothing holds, whatever it
// says.
constexpr std::uint64_t kMostRatio = std::uint64_t{1} << 15;
constexpr std::int32_t kBrick = 32;

Status bad_volume(const std::string& what) {
  return {StatusCode::invalid_argument, "volume frame: " + what + " (use a server that keeps the protocol)"};
}

// The voxels of the frame, decompressed into `room` where they are not.
Status find_voxels(const v1::VolumeFrame& frame, const Payload& payload, std::vector<std::byte>& room,
                   Image& like, std::span<const std::byte>& out) {
  const v1::Array& array = frame.has_content() ? frame.content() : frame.voxels();
  if (!from_proto(array.type(), like.type) || array.components() == 0 || array.components() > 16)
    return bad_volume("its voxels are of no type");
  like.components = static_cast<int>(array.components());
  if (!find(frame.voxels(), payload, out)) return bad_volume("its voxels reach beyond the payload");
  if (!frame.has_content()) return {};
  const std::uint64_t row = scalar_bytes(like.type) * std::uint64_t{array.components()};
  if (array.count() > std::min(kMostBytes, kMostRatio * out.size()) / row)
    return bad_volume("it says that it holds too much");
  const std::uint64_t size = array.count() * row;
  if (frame.voxels().type() != v1::SCALAR_TYPE_U8 || ZSTD_getFrameContentSize(out.data(), out.size()) != size)
    return bad_volume("its voxels are no zstd frame of the size it says");
  room.resize(size);
  if (ZSTD_decompress(room.data(), room.size(), out.data(), out.size()) != size)
    return bad_volume("its voxels are damaged");
  out = room;
  return {};
}

// Whether the grid has as many voxels, which the product of its sizes may say of far larger ones.
bool has_voxels(const ImageGrid& grid, std::uint64_t count) {
  std::uint64_t product = 1;
  for (const std::int32_t n : grid.size) {
    product *= static_cast<std::uint64_t>(n);
    if (product > kMostBytes) return false;
  }
  return product == count;
}

// Copies bricks into the keyframe's voxels.
Status put_bricks(std::span<const std::uint32_t> bricks, std::span<const std::byte> voxels, Image& image) {
  const std::size_t voxel = scalar_bytes(image.type) * static_cast<std::size_t>(image.components);
  std::array<std::uint32_t, 3> count{};
  for (std::size_t a = 0; a < 3; ++a)
    count[a] = static_cast<std::uint32_t>((image.grid.size[a] + kBrick - 1) / kBrick);
  const std::uint64_t all = std::uint64_t{count[0]} * count[1] * count[2];
  std::size_t at = 0;
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    if (bricks[i] >= all || (i > 0 && bricks[i] <= bricks[i - 1]))
      return bad_volume("its bricks are not those of the grid");
    std::array<std::int32_t, 3> first{}, last{};
    std::uint32_t b = bricks[i];
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = kBrick * static_cast<std::int32_t>(b % count[a]);
      last[a] = std::min(first[a] + kBrick, image.grid.size[a]);
      b /= count[a];
    }
    const std::size_t run = static_cast<std::size_t>(last[0] - first[0]) * voxel;
    for (std::int32_t k = first[2]; k < last[2]; ++k) {
      for (std::int32_t j = first[1]; j < last[1]; ++j) {
        if (voxels.size() - at < run) return bad_volume("its bricks are cut short");
        std::copy_n(voxels.data() + at, run, image.bytes.data() + image.grid.offset(first[0], j, k) * voxel);
        at += run;
      }
    }
  }
  return at == voxels.size() ? Status{} : bad_volume("it goes on behind its last brick");
}

}  // namespace

Status VolumeDecoder::decode(const v1::VolumeFrame& frame, const Payload& payload, Image& out) {
  Image like;
  std::span<const std::byte> voxels;
  if (Status status = find_voxels(frame, payload, content_, like, voxels); !status.ok()) return status;
  const std::size_t voxel = scalar_bytes(like.type) * static_cast<std::size_t>(like.components);
  if (frame.has_grid()) {
    if (Status status = from_proto(frame.grid(), like.grid); !status.ok()) return status;
  } else {
    like.grid.size = {static_cast<std::int32_t>(std::min<std::size_t>(voxels.size() / voxel, 1U << 30)), 1,
                      1};
  }
  if (frame.has_bricks()) {
    if (frame.keyframe() == 0 || frame.keyframe() != number_) {
      return {StatusCode::failed_precondition, "volume frame: its keyframe " +
                                                   std::to_string(frame.keyframe()) +
                                                   " did not come (wait for the next keyframe)"};
    }
    std::span<const std::uint32_t> bricks;
    if (!find(frame.bricks(), payload, 1, bricks)) return bad_volume("its bricks are no u32");
    if (like.grid != keyframe_.grid || like.type != keyframe_.type || like.components != keyframe_.components)
      return bad_volume("its grid is not the keyframe's");
    out = keyframe_;
    return put_bricks(bricks, voxels, out);
  }
  if (!has_voxels(like.grid, voxels.size() / voxel) || voxels.size() % voxel != 0)
    return bad_volume("its voxels are not those of its grid");
  like.bytes = std::move(out.bytes);  // its memory
  like.bytes.assign(voxels.begin(), voxels.end());
  out = std::move(like);
  if (frame.keyframe() == 0) return {};
  keyframe_ = out;
  number_ = frame.frame();
  return {};
}

}  // namespace ecorche::wire
