// SPDX-License-Identifier: Apache-2.0
// The frames of one volume subscription as images, whatever was left out or compressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ecorche/values/error.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/wire/framing.hpp>

namespace ecorche::wire {

/// Keeps the last keyframe, as docs/reference/protocol.md asks of clients.
class VolumeDecoder {
 public:
  /// Replaces `out`, in the memory that it has; where it fails, nobody knows what `out` holds. Of slices,
  /// which have no grid, it holds all pixels in one row. invalid_argument for arrays that are not what the
  /// frame says they are, or more than 2^33 bytes; failed_precondition for bricks against a keyframe that did
  /// not come. VolumeFrame.status is the caller's to look at.
  Status decode(const v1::VolumeFrame& frame, const Payload& payload, Image& out);

 private:
  Image keyframe_;
  std::vector<std::byte> content_;  // of a zstd frame
  std::uint64_t number_ = 0;
};

}  // namespace ecorche::wire
