// SPDX-License-Identifier: Apache-2.0
// In which plane limbs bend: what a limb's direction leaves open is how it is turned about itself.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::kinematics {

struct ClipPlaces;

/// The axis about which a limb bends against the one above (a knee, an elbow), as both carry it; unit.
struct LimbBend {
  bool known = false;
  Eigen::Vector3d above = Eigen::Vector3d::Zero();  ///< in the frame of the segment above
  Eigen::Vector3d below = Eigen::Vector3d::Zero();  ///< in the frame of the segment itself
  std::vector<double> angles;                       ///< radians from straight: those that it was found from
};

/// Over frames of a clip: at each hinge between two limbs, the cross product of their directions (joint to
/// joint, so that no rig's own axes matter), carried back into the frames of both clip joints and summed, of
/// frames in which it is bent by 10 degrees or more. Known where the sines are 0.1 in the mean over all
/// frames, always about the same axis (the sum is at least 0.9 of its parts). #segments: row s is the bend
/// between segment s and its parent.
class BendFinder {
 public:
  /// `clip_joint` as in Retarget.
  BendFinder(const Rig& rig, const std::vector<int>& clip_joint);
  void add(const ClipPlaces& places);
  std::vector<LimbBend> bends() const;

 private:
  struct Hinge {
    // Clip joints: where the limb above begins, where they meet, the end.
    std::size_t above = 0, below = 0, end = 0;
    std::size_t segment = 0;
    Eigen::Vector3d sum_above = Eigen::Vector3d::Zero(), sum_below = Eigen::Vector3d::Zero();
    double weight = 0;
    std::vector<double> angles;
  };
  std::size_t segments_, frames_ = 0;
  std::vector<Hinge> hinges_;
};

/// The same sums on the rig's own hinge, flexed from its scanned rest until the limbs stand at each of
/// `angles`: an axis that is not square to its limbs leaves them in another plane at every angle, and a clip
/// that was made with this rig must find its own axis again. Not known where `segment` is no hinge with a
/// sequence, or has no child that tells its direction.
LimbBend bend_of(const Rig& rig, std::size_t segment, const std::vector<double>& angles);

/// Row of the only child of every segment; -1 where it has none or several.
std::vector<int> only_child(const Skeleton& skeleton);

}  // namespace ecorche::kinematics
