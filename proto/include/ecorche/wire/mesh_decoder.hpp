// SPDX-License-Identifier: Apache-2.0
// The frames of one mesh subscription, whatever their encoding, as positions and normals.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <ecorche/values/error.hpp>
#include <ecorche/wire/framing.hpp>

namespace ecorche::wire {

/// One tissue of a frame: what came, and what was made of it.
struct DecodedTissue {
  std::uint32_t tissue = 0;                 ///< row of ModelOpened.tissues
  std::vector<std::uint16_t> numbers;       ///< 3 per vertex; empty under ENCODING_F32
  std::array<double, 3> low{};              ///< mm, LPS: a vertex is at low + step * numbers
  double step = 0;                          ///< mm
  std::vector<std::int8_t> normal_numbers;  ///< 2 per vertex, octahedral; empty where they were not asked for
  std::vector<float> positions;             ///< 3 per vertex, mm, LPS
  std::vector<float> normals;               ///< 3 per vertex, unit or zero; empty where there are no numbers

  /// How many there are.
  std::size_t vertices() const { return (numbers.empty() ? positions.size() : numbers.size()) / 3; }
};

/// Makes `positions` of `numbers`; under ENCODING_F32 they came as they are.
void make_positions(DecodedTissue& tissue);
/// Makes `normals` of `normal_numbers`.
void make_normals(DecodedTissue& tissue);

/// Of the vertices from `first` on, as many as `out` has room for, 3 each. On the calling thread; allocate
/// nothing. There must be numbers of them.
void make_positions(const DecodedTissue& tissue, std::size_t first, std::span<float> out);
void make_normals(const DecodedTissue& tissue, std::size_t first, std::span<float> out);
/// All in 8 bytes a vertex, as graphics cards take them: x, y and z of 16 bits, and the normal as "oct16" of
/// the protocol, 0 where there is none. `out`: 8 bytes a vertex.
void interleave(const DecodedTissue& tissue, std::byte* out);

/// Keeps the keyframes of every level, as docs/reference/protocol.md asks of clients.
class MeshDecoder {
 public:
  /// Replaces `out`, keeping its memory. invalid_argument for arrays that are not what the frame says they
  /// are; failed_precondition for deltas against a keyframe that did not come.
  Status decode(const v1::MeshFrame& frame, const Payload& payload, std::vector<DecodedTissue>& out);
  /// As decode(), for who wants few floats or none: what make_positions() and make_normals() make is left as
  /// it was.
  Status decode_numbers(const v1::MeshFrame& frame, const Payload& payload, std::vector<DecodedTissue>& out);

 private:
  struct Keyframe {
    std::uint64_t frame = 0;
    std::vector<DecodedTissue> tissues;  // numbers alone
  };
  std::map<std::uint32_t, Keyframe> keyframes_;  // by level
};

}  // namespace ecorche::wire
