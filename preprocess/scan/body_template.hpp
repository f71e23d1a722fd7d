// SPDX-License-Identifier: Apache-2.0
// A skeleton with bones of average shape, to be laid over those of a scan.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::scan {

struct TemplateSegment {
  std::string name;  ///< `thigh_left`
  int parent = -1;   ///< row of the parent, always smaller than this row; -1 for the root
  Eigen::Vector3d joint = Eigen::Vector3d::Zero();  ///< where it hangs on its parent, LPS mm
};

struct TemplateBone {
  std::string name;       ///< `femur_left`
  int segment = 0;        ///< row
  Points points;          ///< within its shell, evenly, LPS mm; #points by 3
  double hollow_mm2 = 0;  ///< what it encloses in a slice, up to so much, is marrow
};

/// Standing, arms hanging, facing -y. Left and right are told by the ends of names.
struct BodyTemplate {
  std::vector<TemplateSegment> segments;
  std::vector<TemplateBone> bones;
};

}  // namespace ecorche::scan
