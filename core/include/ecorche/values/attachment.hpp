// SPDX-License-Identifier: Apache-2.0
// What a user says by hand about which skeletal voxel hangs on which segment (Gagvani01 4).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace ecorche {

/// Every skeletal voxel in a box or a ball, LPS mm, borders included, goes to `segment`.
struct AttachmentRegion {
  std::string segment;
  std::string from;  ///< only voxels that hang on this segment; empty: all
  std::optional<std::array<std::array<double, 3>, 2>> box;  ///< lower and upper corner
  std::optional<std::array<double, 3>> center;              ///< of a ball
  double radius = 0;
};

/// Around a joint, voxels of its segment and of the parent segment are parted anew by a plane through it.
struct AttachmentSplit {
  std::string joint;
  double within_mm = 0;
};

/// Splits first, then regions, each in order.
struct Reassignment {
  std::vector<AttachmentSplit> splits;
  std::vector<AttachmentRegion> regions;
};

}  // namespace ecorche
