// SPDX-License-Identifier: Apache-2.0
// Whether a posed body passes, and what is against it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ecorche/runtime/pose_quality.hpp>

namespace ecorche::runtime {

/// Which figure is beyond its threshold.
enum class Figure : std::uint8_t {
  inverted_share,  ///< of the body
  place_inverted,  ///< of the worst place
  place_change,    ///< of the worst place
  volume_change,   ///< unsigned, of the body
  tissue_change,   ///< `row`: of PoseQuality::tissues
  doubtful_joint,  ///< `row`: of PoseQuality::doubtful; the figure is the turn, radians
  bone_rigidity,   ///< mm
  bone_overlap,    ///< mm
};

/// A figure beyond its threshold.
struct Breach {
  Figure figure = Figure::inverted_share;
  std::size_t row = 0;
  double value = 0, threshold = 0;
};

/// All that is beyond a threshold of the quality's own; tissues most beyond theirs come first. Empty: pass.
std::vector<Breach> breaches(const PoseQuality& quality);

/// Row of PoseQuality::tissues whose change is the most in its own threshold; their number where none is
/// closed.
std::size_t worst_tissue(const PoseQuality& quality);

/// Sets the thresholds, those of the tissues too, and `pass`.
void judge(const QualityThresholds& thresholds, PoseQuality& quality);

/// Joints below the root that `pose` turns by more than is granted though they were found with less
/// confidence than is asked; `pose` as PosedBody has it.
std::vector<DoubtfulJoint> doubtful_joints(const Rig& rig, const Pose& pose,
                                           const QualityThresholds& thresholds);

}  // namespace ecorche::runtime
