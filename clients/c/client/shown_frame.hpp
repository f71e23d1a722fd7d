// SPDX-License-Identifier: Apache-2.0
// The last frame that came.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/wire/mesh_decoder.hpp>

namespace ecorche::c {

/// Floats are made of a tissue's numbers when they are first asked for: who draws by numbers has none.
class ShownFrame {
 public:
  /// Replaces what was shown. As MeshDecoder::decode().
  Status take(const v1::MeshFrame& frame, const wire::Payload& payload);
  /// What comes next begins anew; what is shown stays.
  void forget_keyframes() { decoder_ = {}; }
  /// Also, nothing is shown.
  void clear();
  const std::vector<wire::DecodedTissue>& tissues() const { return tissues_; }

  /// Null where the frame does not hold the tissue. Its floats may be those of frames before.
  const wire::DecodedTissue* numbers(std::uint32_t tissue) const;
  /// Its positions are this frame's.
  const wire::DecodedTissue* positions(std::uint32_t tissue);
  /// Its normals are this frame's; none where none came.
  const wire::DecodedTissue* normals(std::uint32_t tissue);

 private:
  struct Made {
    bool positions = false, normals = false;
  };
  wire::MeshDecoder decoder_;
  std::vector<wire::DecodedTissue> tissues_;
  std::vector<Made> made_;  // by row of tissues_
};

}  // namespace ecorche::c
