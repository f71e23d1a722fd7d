// SPDX-License-Identifier: Apache-2.0
// An Acclaim skeleton file as its numbers.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "io/motion/text_stream.hpp"

namespace ecorche::io::asf {

/// One value of a frame: 0 to 2 a turn about x, y, z, 3 to 5 a way along them, 6 a length.
using Freedom = int;

struct Bone {
  std::string name;
  int parent = -1;                                   ///< row, -1 for the root, which is row 0
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< from its own joint to its children's, file units
  Eigen::Quaterniond axis = Eigen::Quaterniond::Identity();  ///< C
  std::vector<Freedom> freedoms;                             ///< in the order of the frame's values
};

struct File {
  std::vector<Bone> bones;  ///< parents first
  double radians = 0;       ///< of one unit of angle
  double unit_mm = 0;       ///< of one unit of length
};

/// Throws Error{data} as open_amc says.
File parse(TextStream& stream);

/// The turn whose angles (radians) are `values`, about fixed axes in the order of `freedoms`; ways are left
/// out.
Eigen::Quaterniond turn_of(const std::vector<Freedom>& freedoms, const double* values, double radians);

}  // namespace ecorche::io::asf
