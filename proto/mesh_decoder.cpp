// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/mesh_decoder.hpp>

#include <algorithm>
#include <string>

#include "proto/arrays.hpp"
#include "proto/delta.hpp"
#include "proto/float_kernels.hpp"
#include "proto/oct16.hpp"

namespace ecorche::wire {
namespace {

constexpr std::uint32_t kMostLevels = 16;  // kept keyframes: what a server says must not fill the memory

Status bad_mesh(const std::string& what) {
  return {StatusCode::invalid_argument, "mesh frame: " + what + " (use a server that keeps the protocol)"};
}

void to_positions(const v1::QuantiseBox& box, DecodedTissue& tissue) {
  tissue.positions.resize(tissue.numbers.size());
  kernels::to_positions(tissue.numbers, {box.low_x(), box.low_y(), box.low_z()}, box.step(),
                        tissue.positions);
}

Status read_normals(const v1::Array& array, const Payload& payload, DecodedTissue& tissue) {
  std::span<const std::int8_t> packed;
  if (!find(array, payload, 2, packed) || packed.size() / 2 != tissue.positions.size() / 3)
    return bad_mesh("its normals are not one per vertex");
  tissue.normals.resize(tissue.positions.size());
  const Oct16Table& table = oct16_table();
  for (std::size_t v = 0; v < packed.size() / 2; ++v) {
    const std::array<float, 3>& normal = table.of(packed[2 * v], packed[2 * v + 1]);
    std::copy(normal.begin(), normal.end(), &tissue.normals[3 * v]);
  }
  return {};
}

}  // namespace

Status MeshDecoder::decode(const v1::MeshFrame& frame, const Payload& payload,
                           std::vector<DecodedTissue>& out) {
  const bool delta = frame.encoding() == v1::ENCODING_U16_DELTA;
  const bool is_key = delta && frame.keyframe() == frame.frame();
  if (!delta && frame.encoding() != v1::ENCODING_F32 && frame.encoding() != v1::ENCODING_U16)
    return bad_mesh("encoding " + std::to_string(frame.encoding()) + " is unknown");
  if (is_key && !keyframes_.contains(frame.level()) && keyframes_.size() >= kMostLevels)
    return bad_mesh("more levels than there are");
  const auto key = keyframes_.find(frame.level());
  if (delta && !is_key && (key == keyframes_.end() || key->second.frame != frame.keyframe())) {
    return {StatusCode::failed_precondition, "mesh frame: its keyframe " + std::to_string(frame.keyframe()) +
                                                 " did not come (wait for the next keyframe)"};
  }
  std::size_t count = 0;  // of tissues
  for (const v1::MeshArray& array : frame.arrays()) {
    if (array.kind() == v1::MeshArray::KIND_NORMALS) {
      if (count == 0 || out[count - 1].tissue != array.tissue()) return bad_mesh("normals without positions");
      if (Status status = read_normals(array.array(), payload, out[count - 1]); !status.ok()) return status;
      continue;
    }
    if (array.kind() != v1::MeshArray::KIND_POSITIONS) continue;
    if (count > 0 && array.tissue() <= out[count - 1].tissue) return bad_mesh("its tissues do not ascend");
    if (out.size() == count) out.emplace_back();
    DecodedTissue& tissue = out[count];
    tissue.tissue = array.tissue();
    tissue.normals.clear();
    tissue.numbers.clear();
    const auto bad_positions = [&](const std::string& what) {
      return bad_mesh("the positions of tissue " + std::to_string(array.tissue()) + what);
    };
    if (frame.encoding() == v1::ENCODING_F32) {
      std::span<const float> positions;
      if (!find(array.array(), payload, 3, positions)) return bad_positions(" are no float32");
      tissue.positions.assign(positions.begin(), positions.end());
    } else if (delta && !is_key) {
      std::span<const std::uint8_t> bytes;
      if (!find(array.array(), payload, 1, bytes)) return bad_positions(" are no deltas");
      const auto& tissues = key->second.tissues;
      if (count >= tissues.size() || tissues[count].tissue != array.tissue())
        return bad_positions(" are not in the keyframe");
      tissue.numbers.resize(tissues[count].numbers.size());
      if (Status status = decode_delta(std::as_bytes(bytes), tissues[count].numbers, tissue.numbers);
          !status.ok())
        return status;
    } else {
      std::span<const std::uint16_t> numbers;
      if (!find(array.array(), payload, 3, numbers)) return bad_positions(" are no u16");
      tissue.numbers.assign(numbers.begin(), numbers.end());
    }
    if (frame.encoding() != v1::ENCODING_F32) to_positions(frame.box(), tissue);
    ++count;
  }
  out.resize(count);
  if (!is_key) return {};
  Keyframe& kept = keyframes_[frame.level()];
  kept.frame = frame.frame();
  kept.tissues.resize(count);
  for (std::size_t t = 0; t < count; ++t) {
    kept.tissues[t].tissue = out[t].tissue;
    kept.tissues[t].numbers = out[t].numbers;
  }
  return {};
}

}  // namespace ecorche::wire
