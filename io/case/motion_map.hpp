// SPDX-License-Identifier: Apache-2.0
// What the names of a motion file mean on a skeleton.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <ecorche/kinematics/named_angles.hpp>
#include "core/kinematics/retarget.hpp"

namespace ecorche::io {

/// Part of a column of an OpenSim motion.
struct AngleShare {
  kinematics::NamedAngle angle;
  double scale = 1;
};

/// Where a marker sits.
struct MarkerPlace {
  std::size_t row = 0;                              ///< of the segment
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the scanned body, LPS mm
};

struct MotionMap {
  kinematics::NameMap joints;                             ///< clip joint -> segment, "" for none
  std::map<std::string, std::vector<AngleShare>> angles;  ///< column -> angles
  std::map<std::string, MarkerPlace> markers;
};

/// `ecorche_motion_map: 1` with `joints`, `angles` and `markers` (docs/reference/motion.md), each of which
/// may be left out. Throws Error{config} for whatever is wrong in it and for what `rig` has not.
MotionMap read_motion_map(const std::filesystem::path& path, const Rig& rig);

/// OpenSim's coordinates as far as `rig` has them: io/case/data/opensim.yaml.
MotionMap opensim_map(const Rig& rig);

}  // namespace ecorche::io
