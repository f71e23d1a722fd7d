// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/mesh_stream.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "proto/arrays.hpp"
#include "proto/oct16.hpp"
#include "runtime/server/session/payload_layout.hpp"

namespace ecorche::server {
namespace {

constexpr std::size_t kBlocksPerRun = 32;           // 16384 vertices
constexpr std::size_t kSlowToMake = 1 << 20;        // bytes
constexpr std::size_t kNumbersPerPiece = 64 << 10;  // looked at in one go

v1::MeshArray& add_array(v1::MeshFrame& frame, std::uint32_t tissue, v1::MeshArray::Kind kind) {
  v1::MeshArray& array = *frame.add_arrays();
  array.set_tissue(tissue);
  array.set_kind(kind);
  return array;
}

void set_box(const runtime::QuantiseBox& from, v1::MeshFrame& frame) {
  v1::QuantiseBox& box = *frame.mutable_box();
  box.set_low_x(from.low[0]);
  box.set_low_y(from.low[1]);
  box.set_low_z(from.low[2]);
  box.set_step(from.step);
}

// The rows of `part` of an array of three per vertex.
template <class T>
std::vector<T> picked(const std::vector<T>& all, const MeshRows& part) {
  std::vector<T> out(3 * part.vertices.size());
  for (std::size_t i = 0; i < part.vertices.size(); ++i)
    std::copy_n(&all[3 * std::size_t{part.vertices[i]}], 3, &out[3 * i]);
  return out;
}

// A number on the side of the box stands for anything beyond it too.
bool inside(std::span<const std::uint16_t> numbers) {
  unsigned outside = 0;
  for (const std::uint16_t n : numbers)
    outside |= static_cast<unsigned>(static_cast<std::uint16_t>(n + 1) <= 1);
  return outside == 0;
}

}  // namespace

MeshStream::MeshStream(MeshSpec spec, std::uint32_t level, std::shared_ptr<const MeshParts> parts,
                       std::vector<std::uint32_t> nodes)
    : spec_(std::move(spec)), level_(level), parts_(std::move(parts)), nodes_(std::move(nodes)) {
  if (parts_) gathered_.resize(spec_.tissues.size());
}

void MeshStream::gather(const runtime::PosedBody& body) {
  if (!parts_) return;
  tbb::parallel_for(std::size_t{0}, gathered_.size(), [&](std::size_t t) {
    const MeshRows& part = (*parts_)[t];
    gathered_[t].resize(3 * part.vertices.size());
    const std::vector<std::uint16_t>& all = body.quantised[spec_.tissues[t]];
    for (std::size_t i = 0; i < part.vertices.size(); ++i)
      std::copy_n(&all[3 * std::size_t{part.vertices[i]}], 3, &gathered_[t][3 * i]);
  });
}

std::span<const std::uint16_t> MeshStream::numbers(const runtime::PosedBody& body, std::size_t t) const {
  if (parts_) return gathered_[t];
  return body.quantised[spec_.tissues[t]];
}

bool MeshStream::fits_box(const runtime::PosedBody& body) const {
  std::atomic<bool> good = true;
  tbb::parallel_for(std::size_t{0}, spec_.tissues.size(), [&](std::size_t t) {
    const std::span<const std::uint16_t> all = numbers(body, t);
    const std::size_t pieces = (all.size() + kNumbersPerPiece - 1) / kNumbersPerPiece;
    tbb::parallel_for(std::size_t{0}, pieces, [&](std::size_t p) {
      const std::size_t first = p * kNumbersPerPiece;
      if (!inside(all.subspan(first, std::min(kNumbersPerPiece, all.size() - first)))) good = false;
    });
  });
  return good;
}

// oct16, into `packed`.
void MeshStream::pack_normals(const runtime::PosedBody& body, std::size_t t,
                              std::vector<std::int8_t>& packed) const {
  const std::uint32_t tissue = spec_.tissues[t];
  const auto pack = [&](std::span<const std::int16_t> unit) {
    packed.resize(unit.size() / 3 * 2);
    wire::to_oct16(unit, packed);
  };
  if (parts_) {
    pack(picked(body.normals[tissue], (*parts_)[t]));
  } else {
    pack(body.normals[tissue]);
  }
}

// The arrays of every tissue, positions by `add`, then its normals.
template <class Add>
void MeshStream::lay_out(const runtime::PosedBody& body, v1::MeshFrame& frame, wire::Payload& payload,
                         Add&& add) {
  std::vector<std::vector<std::int8_t>> normals(spec_.normals ? spec_.tissues.size() : 0);
  tbb::parallel_for(std::size_t{0}, normals.size(),
                    [&](std::size_t t) { pack_normals(body, t, normals[t]); });
  PayloadLayout layout;
  for (std::size_t t = 0; t < spec_.tissues.size(); ++t) {
    add(layout, t, *add_array(frame, spec_.tissues[t], v1::MeshArray::KIND_POSITIONS).mutable_array());
    if (!spec_.normals) continue;
    layout.append(*add_array(frame, spec_.tissues[t], v1::MeshArray::KIND_NORMALS).mutable_array(),
                  v1::SCALAR_TYPE_I8, 2, std::span<const std::int8_t>(normals[t]));
  }
  layout.fill(payload);
}

void MeshStream::write_nodes(const runtime::PosedBody& body, v1::MeshFrame& frame,
                             wire::Payload& payload) const {
  payload.clear();
  std::vector<float> nodes(3 * nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    std::copy_n(&body.nodes[3 * std::size_t{nodes_[i]}], 3, &nodes[3 * i]);
  *add_array(frame, 0, v1::MeshArray::KIND_NODES).mutable_array() =
      wire::append(payload, std::span<const float>(nodes), 3);
  std::vector<double> motions;
  for (const RigidTransform& segment : body.segments) {
    const Eigen::Matrix3d turn = segment.q.toRotationMatrix();
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) motions.push_back(turn(r, c));
      motions.push_back(segment.t[r]);
    }
  }
  *add_array(frame, 0, v1::MeshArray::KIND_SEGMENTS).mutable_array() =
      wire::append(payload, std::span<const double>(motions), 12);
}

void MeshStream::write_motions(const runtime::PosedBody& body, v1::MeshFrame& frame,
                               wire::Payload& payload) const {
  payload.clear();
  std::vector<double> motions;
  for (const RigidTransform& segment : body.segments) {
    motions.insert(motions.end(), {segment.q.w(), segment.q.x(), segment.q.y(), segment.q.z(), segment.t.x(),
                                   segment.t.y(), segment.t.z()});
  }
  *add_array(frame, 0, v1::MeshArray::KIND_MOTIONS).mutable_array() =
      wire::append(payload, std::span<const double>(motions), 7);
  set_box(body.box, frame);
}

bool MeshStream::keyframe_due(std::uint64_t frame) const {
  // The last keyframe was never made ready for deltas: its job found no memory.
  if (unsettled_) return true;
  // Deltas that have grown to half a keyframe: the pose is another one by now. Those of a small mesh are as
  // large from the first.
  const bool grown = 2 * last_bytes_ > keyframe_bytes_ && 2 * last_bytes_ > 3 * first_bytes_;
  return keyframe_ == 0 || frame - keyframe_ >= keyframe_interval || grown;
}

bool MeshStream::write(const runtime::PosedBody& body, bool boxed, bool keyframe, v1::MeshFrame& frame,
                       wire::Payload& payload) {
  const v1::Encoding encoding = boxed ? spec_.encoding : v1::ENCODING_F32;
  frame.set_encoding(encoding);
  frame.set_level(level_);
  if (spec_.control_nodes) {
    write_nodes(body, frame, payload);
    return true;
  }
  if (spec_.motions) {
    write_motions(body, frame, payload);
    return true;
  }
  if (encoding != v1::ENCODING_F32) {
    set_box(body.box, frame);
    gather(body);
  } else {
    frame.clear_box();
  }
  if (encoding == v1::ENCODING_U16_DELTA && !keyframe && !keyframe_due(frame.frame()))
    return write_deltas(body, frame, payload);
  if (encoding != v1::ENCODING_F32 && !fits_box(body)) return false;

  std::vector<std::vector<float>> some(parts_ && encoding == v1::ENCODING_F32 ? spec_.tissues.size() : 0);
  lay_out(body, frame, payload, [&](PayloadLayout& layout, std::size_t t, v1::Array& array) {
    const std::vector<float>& positions = body.tissues[spec_.tissues[t]];
    if (encoding != v1::ENCODING_F32) {
      layout.append(array, v1::SCALAR_TYPE_U16, 3, numbers(body, t));
    } else if (parts_) {
      some[t] = picked(positions, (*parts_)[t]);
      layout.append(array, v1::SCALAR_TYPE_F32, 3, std::span<const float>(some[t]));
    } else {
      layout.append(array, v1::SCALAR_TYPE_F32, 3, std::span<const float>(positions));
    }
  });
  if (encoding != v1::ENCODING_U16_DELTA) return true;
  frame.set_keyframe(frame.frame());
  keyframe_ = frame.frame();
  keyframe_bytes_ = payload.size();
  first_bytes_ = last_bytes_ = 0;
  unsettled_ = true;
  return true;
}

wire::Pieces MeshStream::show(const std::shared_ptr<const Positions>& positions, v1::MeshFrame& frame) const {
  frame.set_encoding(v1::ENCODING_F32);
  frame.set_level(level_);
  PayloadLayout layout;
  for (const std::uint32_t tissue : spec_.tissues) {
    layout.append(*add_array(frame, tissue, v1::MeshArray::KIND_POSITIONS).mutable_array(),
                  v1::SCALAR_TYPE_F32, 3, std::span<const float>((*positions)[tissue]));
  }
  return layout.pieces(positions);
}

void MeshStream::settle(const runtime::PosedBody& body) {
  if (!unsettled_) return;
  if (keys_.empty()) {
    std::vector<wire::DeltaKey> keys;
    runs_.clear();
    for (std::uint32_t t = 0; t < spec_.tissues.size(); ++t) {
      keys.emplace_back(numbers(body, t).size() / 3);
      for (std::size_t b = 0; b < keys[t].blocks(); b += kBlocksPerRun) {
        const std::size_t end = std::min(keys[t].blocks(), b + kBlocksPerRun);
        const std::size_t capacity = wire::delta::most_bytes(end - b);
        runs_.push_back({.tissue = t,
                         .first = static_cast<std::uint32_t>(b),
                         .end = static_cast<std::uint32_t>(end),
                         .capacity = capacity,
                         .bytes = std::make_unique_for_overwrite<std::byte[]>(capacity)});
      }
    }
    keys_ = std::move(keys);
  }
  tbb::parallel_for(std::size_t{0}, runs_.size(), [&](std::size_t r) {
    const Run& run = runs_[r];
    keys_[run.tissue].prepare(numbers(body, run.tissue), run.first, run.end);
  });
  unsettled_ = false;
}

bool MeshStream::write_deltas(const runtime::PosedBody& body, v1::MeshFrame& frame, wire::Payload& payload) {
  std::atomic<bool> good = true;
  tbb::parallel_for(std::size_t{0}, runs_.size(), [&](std::size_t r) {
    Run& run = runs_[r];
    // A number on the side of the box stands for anything beyond it too.
    const wire::EncodedDelta made = keys_[run.tissue].encode(numbers(body, run.tissue), run.first, run.end,
                                                             {run.bytes.get(), run.capacity});
    if (made.on_side) good = false;
    run.size = made.bytes;
  });
  if (!good) return false;
  // The next keyframe must not wait for memory.
  if (keyframe_bytes_ >= kSlowToMake) payload.reserve(keyframe_bytes_);
  std::size_t r = 0;
  lay_out(body, frame, payload, [&](PayloadLayout& layout, std::size_t t, v1::Array& array) {
    layout.begin(array, v1::SCALAR_TYPE_U8, 1);
    for (; r < runs_.size() && runs_[r].tissue == t; ++r) layout.add({runs_[r].bytes.get(), runs_[r].size});
    layout.end(1);
  });
  frame.set_keyframe(keyframe_);
  last_bytes_ = payload.size();
  if (first_bytes_ == 0) first_bytes_ = last_bytes_;
  return true;
}

}  // namespace ecorche::server
