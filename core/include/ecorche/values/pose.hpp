// SPDX-License-Identifier: Apache-2.0
// A pose of a rig, and a motion clip as it stands in a file.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace ecorche {

/// All identity and zero is the scanned rest pose.
struct Pose {
  /// Added to the root, LPS mm.
  Eigen::Vector3d root_translation = Eigen::Vector3d::Zero();
  /// Per joint, in the joint's frame, from the scanned rest pose. Unit; row 0 is the root.
  std::vector<Eigen::Quaterniond> rotation;
  /// Per joint, mm, in the joint's frame; zero but for `free` joints and couplings. Row 0 is unused.
  std::vector<Eigen::Vector3d> translation;

  /// The scanned pose of so many joints.
  static Pose rest(std::size_t joints) {
    return {Eigen::Vector3d::Zero(), std::vector<Eigen::Quaterniond>(joints, Eigen::Quaterniond::Identity()),
            std::vector<Eigen::Vector3d>(joints, Eigen::Vector3d::Zero())};
  }
};

/// What limits took away from a joint.
struct ClampedJoint {
  int joint = 0;
  double removed = 0;  ///< radians: the turn between what was asked and what was done
};

/// A joint of a motion file.
struct ClipJoint {
  std::string name;
  int parent = -1;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< from the parent at the clip's zero pose, LPS mm
};

/// A motion clip, already in LPS and mm, still on its own joints.
struct Clip {
  std::string name;
  double frame_seconds = 1.0 / 30.0;
  std::vector<ClipJoint> joints;               ///< parents first
  std::vector<Eigen::Vector3d> root_position;  ///< per frame, LPS mm
  std::vector<Eigen::Quaterniond> rotation;    ///< frame * #joints + joint; local, axes parallel to LPS
  /// How many.
  std::size_t frames() const { return root_position.size(); }
};

}  // namespace ecorche
