// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/joint_evidence.hpp"

#include "preprocess/rig/found_point.hpp"

namespace ecorche::rig {

JointEvidence evidence_of(const FoundPoint& found, double center_confidence, double axes_confidence) {
  JointEvidence out{
      found.fit.rule, center_confidence, axes_confidence, found.at, found.axis, found.fit.radius_mm, {}};
  for (const SurfacePoints* on : found.on) {
    for (Eigen::Index p = 0; p < on->at.rows(); ++p) out.vertices.push_back(on->at.row(p).transpose());
  }
  return out;
}

}  // namespace ecorche::rig
