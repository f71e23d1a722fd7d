// SPDX-License-Identifier: Apache-2.0
// The frames of one mesh subscription, one after another.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <ecorche/v1/envelope.pb.h>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/wire/framing.hpp>
#include "proto/delta.hpp"
#include "runtime/server/resources/payload_pool.hpp"
#include "runtime/server/session/mesh_rows.hpp"
#include "runtime/server/session/subscription.hpp"

namespace ecorche::server {

/// Writes the arrays of each frame, and keeps the keyframe that deltas are against. One job of the session at
/// a time uses it, on a worker.
class MeshStream {
 public:
  /// Frames from one keyframe to the next: 0.4 % are keyframes, or come after one that is being made
  /// ready, so that the tail of latencies is not theirs.
  static constexpr std::uint64_t keyframe_interval = 512;

  /// `parts`: of the tissues of `spec`, one for each, null where they are whole. `nodes`: of
  /// MeshSpec::control_nodes.
  MeshStream(MeshSpec spec, std::uint32_t level, std::shared_ptr<const MeshParts> parts,
             std::vector<std::uint32_t> nodes = {});

  const MeshSpec& spec() const { return spec_; }
  std::uint32_t level() const { return level_; }
  const MeshParts* parts() const { return parts_.get(); }
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }

  /// What the frame needs of the posed body.
  bool needs_numbers() const { return spec_.encoding != v1::ENCODING_F32; }
  bool needs_positions() const { return spec_.encoding == v1::ENCODING_F32 && !moved_by_client(); }
  bool moved_by_client() const { return spec_.control_nodes || spec_.motions; }

  /// Whether its frames' payload is positions just as they are posed.
  bool plain() const { return needs_positions() && !parts_ && !spec_.normals; }
  /// Of a plain one: as write(), without a copy. `positions`: per tissue of the model.
  wire::Pieces show(const std::shared_ptr<const Positions>& positions, v1::MeshFrame& frame) const;

  /// Fills encoding, arrays, box and keyframe of `frame`, whose number is set. `keyframe`: somebody needs
  /// one. `payload` is replaced. False where a vertex lies outside the body's box: then nothing was written
  /// that counts, and the frame goes out as float32, by another call with `boxed` false and a body that has
  /// positions.
  bool write(const runtime::PosedBody& body, bool boxed, bool keyframe, v1::MeshFrame& frame,
             wire::Payload& payload);
  /// After a keyframe has left: readies it for the deltas to come. Cheap where nothing is to be done.
  void settle(const runtime::PosedBody& body);

 private:
  void write_motions(const runtime::PosedBody& body, v1::MeshFrame& frame, wire::Payload& payload) const;
  void write_nodes(const runtime::PosedBody& body, v1::MeshFrame& frame, wire::Payload& payload) const;
  bool write_deltas(const runtime::PosedBody& body, v1::MeshFrame& frame, wire::Payload& payload);
  void pack_normals(const runtime::PosedBody& body, std::size_t t, std::vector<std::int8_t>& packed) const;
  template <class Add>
  void lay_out(const runtime::PosedBody& body, v1::MeshFrame& frame, wire::Payload& payload, Add&& add);
  /// The numbers of tissue `t` of the spec, gathered where it is a part.
  void gather(const runtime::PosedBody& body);
  std::span<const std::uint16_t> numbers(const runtime::PosedBody& body, std::size_t t) const;
  bool fits_box(const runtime::PosedBody& body) const;
  bool keyframe_due(std::uint64_t frame) const;

  struct Run {
    std::uint32_t tissue, first, end;  // row of `spec_.tissues`, blocks
    std::size_t capacity;
    std::unique_ptr<std::byte[]> bytes;  // of the present deltas; left as it is made, which touches nothing
    std::size_t size = 0;
  };

  MeshSpec spec_;
  std::uint32_t level_;
  std::shared_ptr<const MeshParts> parts_;
  std::vector<std::uint32_t> nodes_;
  std::vector<std::vector<std::uint16_t>> gathered_;  // of parts, one per tissue of the spec
  std::vector<wire::DeltaKey> keys_;                  // one per tissue of the spec
  std::vector<Run> runs_;
  std::uint64_t keyframe_ = 0;  // number of its frame; 0: none yet
  std::size_t keyframe_bytes_ = 0;
  std::size_t first_bytes_ = 0, last_bytes_ = 0;  // of the deltas against it
  bool unsettled_ = false;
};

}  // namespace ecorche::server
