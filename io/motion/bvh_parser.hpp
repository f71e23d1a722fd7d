// SPDX-License-Identifier: Apache-2.0
// A BVH file as its numbers, in its own frame, units and channel order.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace ecorche::io::bvh {

enum class Channel : unsigned char { x_position, y_position, z_position, x_rotation, y_rotation, z_rotation };

struct FileJoint {
  std::string name;
  int parent = -1;  ///< -1 for the one root, which comes first
  std::array<double, 3> offset{0, 0, 0};
  std::vector<Channel> channels;  ///< in the order of the file's values
};

struct File {
  std::vector<FileJoint> joints;  ///< parents first, without end sites
  std::size_t channels = 0;       ///< of all joints
  std::size_t frames = 0;
  double frame_seconds = 0;
  std::vector<double> values;  ///< frames * channels, degrees and file units
};

/// Throws Error{data} naming `where` and the line: anything but one hierarchy and all of its frames, names or
/// channels that stand twice, numbers that are not finite, and files that would need more than 2^26
/// rotations.
File parse(std::string_view text, const std::string& where);

}  // namespace ecorche::io::bvh
