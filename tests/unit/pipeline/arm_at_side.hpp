// SPDX-License-Identifier: Apache-2.0
// The smallest body with a limb beside it.
#pragma once

#include <utility>

#include <ecorche/values/case.hpp>
#include "tests/unit/pipeline/two_bones.hpp"

namespace ecorche::test {

/// A trunk of 100 x 60 x 300 mm and an arm that hangs from its top, `gap` mm beside it.
inline Case arm_at_side(double gap) {
  Case patient;
  patient.name = "arm";
  patient.skeleton.name = "arm";
  for (const auto& [name, parent] : {std::pair("trunk", -1), std::pair("arm", 0), std::pair("hand", 1)}) {
    Segment segment;
    segment.name = name;
    segment.parent = parent;
    segment.joint.name = std::string(name) + "_joint";
    segment.joint.sequence = {{"flexion", 0}, {"adduction", 1}, {"rotation", 2}};
    patient.skeleton.segments.push_back(segment);
  }
  const double x = 100 + gap;
  patient.skeleton.segments[0].joint.center = {50, 30, 20};
  patient.skeleton.segments[1].joint.center = {x + 15, 30, 280};
  patient.skeleton.segments[2].joint.center = {x + 15, 30, 120};
  const auto add = [](SurfaceMesh& to, const SurfaceMesh& more) {
    const Eigen::Index v = to.V.rows(), f = to.F.rows();
    to.V.conservativeResize(v + more.V.rows(), 3);
    to.F.conservativeResize(f + more.F.rows(), 3);
    to.V.bottomRows(more.V.rows()) = more.V;
    to.F.bottomRows(more.F.rows()) = more.F.array() + static_cast<std::int32_t>(v);
  };
  patient.skin = box({0, 0, 0}, {100, 60, 300});
  add(patient.skin, box({x, 15, 50}, {x + 30, 45, 300}));
  add(patient.skin, box({90, 15, 260}, {x + 1, 45, 300}));
  patient.bones = {{"spine", "trunk", box({70, 20, 20}, {90, 40, 280})},
                   {"humerus", "arm", box({x + 10, 25, 130}, {x + 20, 35, 275})},
                   {"fist", "hand", box({x + 10, 25, 60}, {x + 20, 35, 115})}};
  return patient;
}

}  // namespace ecorche::test
