// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/mesh_decoder.hpp>

#include <cstring>
#include <string>

#include "proto/arrays.hpp"
#include "proto/delta.hpp"
#include "proto/float_kernels.hpp"

namespace ecorche::wire {
namespace {

constexpr std::uint32_t kMostLevels = 16;  // kept keyframes: what a server says must not fill the memory

constexpr std::uint64_t kThreeNumbers = (std::uint64_t{1} << 48U) - 1;
constexpr std::uint16_t kOct16 = 0x8080;  // from two int8 to "oct16" and back

Status bad_mesh(const std::string& what) {
  return {StatusCode::invalid_argument, "mesh frame: " + what + " (use a server that keeps the protocol)"};
}

// Of the payload, which no two arrays share: else a frame would grow as many times as it names one.
class Share {
 public:
  explicit Share(const Payload& payload) : left_(payload.size()) {}
  template <class T>
  bool take(std::span<const T> array) {
    if (array.size_bytes() > left_) return false;
    left_ -= array.size_bytes();
    return true;
  }

 private:
  std::size_t left_;
};

Status read_normals(const v1::Array& array, const Payload& payload, Share& share, DecodedTissue& tissue) {
  std::span<const std::int8_t> packed;
  if (!find(array, payload, 2, packed) || packed.size() / 2 != tissue.vertices())
    return bad_mesh("its normals are not one per vertex");
  if (!share.take(packed)) return bad_mesh("its arrays lie in one another");
  tissue.normal_numbers.assign(packed.begin(), packed.end());
  return {};
}

}  // namespace

void make_positions(const DecodedTissue& tissue, std::size_t first, std::span<float> out) {
  kernels::to_positions(std::span(tissue.numbers).subspan(3 * first, out.size()), tissue.low, tissue.step,
                        out);
}

void make_normals(const DecodedTissue& tissue, std::size_t first, std::span<float> out) {
  kernels::to_normals(std::span(tissue.normal_numbers).subspan(2 * first, out.size() / 3 * 2), out);
}

void make_positions(DecodedTissue& tissue) {
  if (tissue.numbers.empty()) return;
  tissue.positions.resize(tissue.numbers.size());
  make_positions(tissue, 0, tissue.positions);
}

void make_normals(DecodedTissue& tissue) {
  tissue.normals.resize(tissue.normal_numbers.size() / 2 * 3);
  make_normals(tissue, 0, tissue.normals);
}

void interleave(const DecodedTissue& tissue, std::byte* out) {
  const std::size_t count = tissue.vertices();
  const std::uint16_t* numbers = tissue.numbers.data();
  const bool normals = !tissue.normal_numbers.empty();
  for (std::size_t v = 0; v < count; ++v, numbers += 3, out += 8) {
    // One word, written at once. Of the last vertex alone there is nothing to read behind it.
    std::uint64_t word = 0;
    std::memcpy(&word, numbers, v + 1 < count ? 8 : 6);
    std::uint16_t normal = kOct16;
    if (normals) std::memcpy(&normal, &tissue.normal_numbers[2 * v], 2);
    normal ^= kOct16;
    word = (word & kThreeNumbers) | std::uint64_t{normal} << 48U;
    std::memcpy(out, &word, 8);
  }
}

Status MeshDecoder::decode(const v1::MeshFrame& frame, const Payload& payload,
                           std::vector<DecodedTissue>& out) {
  if (Status status = decode_numbers(frame, payload, out); !status.ok()) return status;
  for (DecodedTissue& tissue : out) {
    make_positions(tissue);
    make_normals(tissue);
  }
  return {};
}

Status MeshDecoder::decode_numbers(const v1::MeshFrame& frame, const Payload& payload,
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
  Share share(payload);
  for (const v1::MeshArray& array : frame.arrays()) {
    if (array.kind() == v1::MeshArray::KIND_NORMALS) {
      if (count == 0 || out[count - 1].tissue != array.tissue()) return bad_mesh("normals without positions");
      if (Status status = read_normals(array.array(), payload, share, out[count - 1]); !status.ok())
        return status;
      continue;
    }
    if (array.kind() != v1::MeshArray::KIND_POSITIONS) continue;
    if (count > 0 && array.tissue() <= out[count - 1].tissue) return bad_mesh("its tissues do not ascend");
    if (out.size() == count) out.emplace_back();
    DecodedTissue& tissue = out[count];
    tissue.tissue = array.tissue();
    tissue.normal_numbers.clear();
    tissue.low = {frame.box().low_x(), frame.box().low_y(), frame.box().low_z()};
    tissue.step = frame.box().step();
    const auto bad_positions = [&](const std::string& what) {
      return bad_mesh("the positions of tissue " + std::to_string(array.tissue()) + what);
    };
    if (frame.encoding() == v1::ENCODING_F32) {
      std::span<const float> positions;
      if (!find(array.array(), payload, 3, positions)) return bad_positions(" are no float32");
      if (!share.take(positions)) return bad_positions(" lie where others do");
      tissue.positions.assign(positions.begin(), positions.end());
      tissue.numbers.clear();
    } else if (delta && !is_key) {
      std::span<const std::uint8_t> bytes;
      if (!find(array.array(), payload, 1, bytes)) return bad_positions(" are no deltas");
      if (!share.take(bytes)) return bad_positions(" lie where others do");
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
      if (!share.take(numbers)) return bad_positions(" lie where others do");
      tissue.numbers.assign(numbers.begin(), numbers.end());
    }
    if (frame.encoding() != v1::ENCODING_F32 && tissue.numbers.empty()) tissue.positions.clear();
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
