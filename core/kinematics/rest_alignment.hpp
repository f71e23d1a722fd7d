// SPDX-License-Identifier: Apache-2.0
// From the scan's pose to a pose of a clip that both can be held against.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include "core/kinematics/limb_bends.hpp"

namespace ecorche::kinematics {

/// One frame of a clip, as Clip holds them.
struct ClipFrame {
  Eigen::Vector3d root_position = Eigen::Vector3d::Zero();
  std::vector<Eigen::Quaterniond> rotation;  ///< #joints
};

/// Where a clip's joints stand, and how they are turned, in space.
struct ClipPlaces {
  std::vector<Eigen::Vector3d> point;    ///< mm LPS
  std::vector<Eigen::Quaterniond> turn;  ///< from the clip's zero pose
};

/// Of a frame, or of the zero pose. Throws Error{internal} where the frame has not one rotation a joint.
ClipPlaces places(const Clip& clip, const ClipFrame& frame);
ClipPlaces zero_places(const Clip& clip);

/// How the joints of a clip stand to the segments of a rig.
struct RestAlignment {
  /// #segments: with G the global turn of the clip's joint, G * alignment is the segment's from the scan; the
  /// identity where no joint moves it.
  std::vector<Eigen::Quaterniond> alignment;
  std::vector<Eigen::Quaterniond> rest_turn;  ///< #segments: that at the first reference, parents' followed
};

/// From the scanned rest pose to `references`: a motion file's zero pose is its maker's (often arms out, or
/// legs apart), the scan's is how the patient lay. The root turns about the vertical until the joints beside
/// it (hips, shoulders) face as the clip's do; both stand upright there, which is what makes it a reference.
/// Down the tree, a segment first takes its parent's turn; where it is a limb, so that its direction means
/// the same thing in both, it is then turned the shortest way onto the clip's direction. A limb has one
/// child, which the clip moves too, at least 12 % of the skeleton's extent away: shorter segments (clavicle,
/// hand, foot) and those with several children (pelvis, chest) have directions that are the maker's choice.
/// About itself a limb is then turned until it bends in the plane in which the clip's bends, where `bends`
/// (BendFinder's) tell that: otherwise an arm that hangs and one that is held out leave its elbow anywhere.
/// Of several references the mean is taken, segment by segment from the root on, those in which limbs point
/// as the scan's do most of all (the least rms angle over that of the reference): a hand or a straight limb
/// that one frame has turned aside is straight in the mean. `clip_joint`: as in Retarget.
/// Throws Error{internal} for no reference.
RestAlignment align_rest(const Rig& rig, std::span<const ClipPlaces> references,
                         const std::vector<int>& clip_joint, const std::vector<LimbBend>& bends = {});

/// Mends `at_zero`, the alignment of a zero pose, from `over_clip`, that of frames of the same clip: what
/// ends a limb without being one (a hand), and what follows it, keeps its stance on the limb in the mean of
/// the frames, where the zero pose holds the limb more than 45 degrees away from the scan. How a hand is
/// turned against an arm that a T-pose stretches out is no longer that of an arm that hangs.
void hang_ends(const Rig& rig, const ClipPlaces& zero, const std::vector<int>& clip_joint,
               const RestAlignment& over_clip, RestAlignment& at_zero);

/// How the limbs of a clip stand beside the scan's, the root's turn about the vertical taken out.
struct LimbCheck {
  double rms = 0, worst = 0;  ///< radians between the directions of limbs that both have
  double figure = 1;          ///< length of those limbs in the clip over that in the scan
  int limbs = 0;
};
LimbCheck check_limbs(const Rig& rig, const ClipPlaces& reference, const std::vector<int>& clip_joint);

}  // namespace ecorche::kinematics
