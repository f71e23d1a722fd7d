// SPDX-License-Identifier: Apache-2.0
// The frames of one mesh subscription, whatever their encoding, as positions and normals.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <ecorche/values/error.hpp>
#include <ecorche/wire/framing.hpp>

namespace ecorche::wire {

/// One tissue of a frame.
struct DecodedTissue {
  std::uint32_t tissue = 0;            ///< row of ModelOpened.tissues
  std::vector<std::uint16_t> numbers;  ///< 3 per vertex; empty under ENCODING_F32
  std::vector<float> positions;        ///< 3 per vertex, mm, LPS
  std::vector<float> normals;          ///< 3 per vertex, unit or zero; empty where they were not asked for
};

/// Keeps the keyframes of every level, as docs/reference/protocol.md asks of clients.
class MeshDecoder {
 public:
  /// Replaces `out`, keeping its memory. invalid_argument for arrays that are not what the frame says they
  /// are; failed_precondition for deltas against a keyframe that did not come.
  Status decode(const v1::MeshFrame& frame, const Payload& payload, std::vector<DecodedTissue>& out);

 private:
  struct Keyframe {
    std::uint64_t frame = 0;
    std::vector<DecodedTissue> tissues;  // numbers alone
  };
  std::map<std::uint32_t, Keyframe> keyframes_;  // by level
};

}  // namespace ecorche::wire
