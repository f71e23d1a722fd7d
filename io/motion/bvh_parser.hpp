// SPDX-License-Identifier: Apache-2.0
// A BVH file as its numbers, in its own frame, units and channel order.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "io/motion/text_stream.hpp"

namespace ecorche::io::bvh {

enum class Channel : unsigned char { x_position, y_position, z_position, x_rotation, y_rotation, z_rotation };

struct FileJoint {
  std::string name;
  int parent = -1;  ///< -1 for the one root, which comes first
  std::array<double, 3> offset{0, 0, 0};
  std::vector<Channel> channels;  ///< in the order of the file's values
};

struct Header {
  std::vector<FileJoint> joints;  ///< parents first, without end sites
  std::size_t channels = 0;       ///< of all joints
  std::size_t frames = 0;         ///< as the file says
  double frame_seconds = 0;
};

/// Everything before the first frame. Throws Error{data} naming the line: anything but one hierarchy, names
/// or channels that stand twice, numbers that are not finite, more frames than the file can hold.
Header read_header(TextStream& stream);

/// The values of one frame, degrees and file units; false after the last, where the file must end.
bool read_frame(TextStream& stream, const Header& header, std::size_t frame, std::span<double> values);

}  // namespace ecorche::io::bvh
