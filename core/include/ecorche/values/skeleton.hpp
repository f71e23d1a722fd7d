// SPDX-License-Identifier: Apache-2.0
// The virtual skeleton: segments, each with the one joint about which it turns.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace ecorche {

enum class JointKind : std::uint8_t {
  ball,       ///< three turns
  hinge,      ///< the first turn of `sequence` only
  universal,  ///< the first two turns of `sequence`
  fixed,      ///< none
  free,       ///< three turns and a translation
};

/// How a joint centre is found.
enum class CenterRule : std::uint8_t {
  given,         ///< `center: [x, y, z]`, LPS mm
  sphere_fit,    ///< sphere through the surface of `center_bone` that faces `facing_bone`, or as `Joint::how`
                 ///< says
  cylinder_fit,  ///< on its axis, halfway between its outermost points
  plane_fit,     ///< mean of its points
  ellipse_fit,   ///< its centre
  centroid,      ///< mean of a region's vertices
  between,       ///< two other points
  joint,         ///< another joint's centre
  first_good,    ///< the first of several that is found well
  facing,  ///< midway between the surfaces of segment and parent that face each other: where all else fails
};

struct JointRule;  // core/values/joint_rule.hpp

/// One anatomical angle: a turn about one axis of the joint frame. In `Joint::sequence` order the turns are
/// intrinsic: R = R(first) R(second) R(third).
struct AngleAxis {
  std::string name;  ///< `flexion`, `adduction`, `rotation`: a pose file says `flexion_deg`
  int axis = 0;      ///< 0 x, 1 y, 2 z of the joint frame
  double sign = 1;   ///< -1 where the positive anatomical angle is the negative turn
  double rest = 0;   ///< radians: the anatomical angle of the scanned rest pose
  double min = -std::numeric_limits<double>::infinity();  ///< radians, anatomical; no limit by default
  double max = std::numeric_limits<double>::infinity();
};

/// `angle = ratio * (angle of the leading joint)`, about rest: what a rhythm adds (knee roll-back, spine).
struct Coupling {
  std::string joint;  ///< the leading joint; this joint itself may lead its own slide
  std::string angle;  ///< its angle
  std::string
      drives;  ///< the angle of this joint that follows, or its slide along an axis: `x_mm`, `y_mm`, `z_mm`
  double ratio = 0;  ///< radians a radian; of a slide mm a radian

  /// 0, 1 or 2: the axis along which it slides, at rest; -1 where it drives an angle.
  int slides() const {
    return drives.size() == 4 && drives.ends_with("_mm") && drives[0] >= 'x' && drives[0] <= 'z'
               ? drives[0] - 'x'
               : -1;
  }
};

/// Where a segment turns about its parent.
struct Joint {
  std::string name;
  JointKind kind = JointKind::ball;
  CenterRule rule = CenterRule::given;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< LPS mm, where rule is `given`
  std::string center_bone, facing_bone;              ///< where rule is `sphere_fit`, without `how`
  std::shared_ptr<const JointRule> how;              ///< null: what stands here says all
  /// Columns are the x, y, z axes of the joint frame in the scanned rest pose, LPS; orthonormal,
  /// right-handed.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  std::vector<AngleAxis> sequence;  ///< three different axes; hinges use the first, universals the first two
  std::string limits_source;
  std::vector<Coupling> coupled;
};

/// A rigid part of the skeleton, with the one joint about which it turns.
struct Segment {
  std::string name;
  int parent = -1;  ///< row of the parent, always smaller than this row; -1 for the root
  Joint joint;
  std::vector<std::string> aliases;  ///< names in motion files
  bool boneless =
      false;  ///< moves nothing and owns no bone: its joint is there to lead others. No model keeps it
};

/// Parents first; segment i has joint i. Row 0 is the root.
struct Skeleton {
  std::string name;
  std::vector<Segment> segments;

  /// Row of the segment, or -1.
  int find_segment(std::string_view name_) const {
    for (std::size_t i = 0; i < segments.size(); ++i) {
      if (segments[i].name == name_) return static_cast<int>(i);
    }
    return -1;
  }
  /// Row of the joint, or -1.
  int find_joint(std::string_view name_) const {
    for (std::size_t i = 0; i < segments.size(); ++i) {
      if (segments[i].joint.name == name_) return static_cast<int>(i);
    }
    return -1;
  }
};

/// How well one joint was found.
struct JointFit {
  std::string joint;
  CenterRule rule = CenterRule::given;
  double radius_mm = 0;     ///< of a fitted sphere or cylinder, or an ellipse's mean half axis; else 0
  double residual_mm = 0;   ///< rms distance of the points from the fitted surface, 0 where given
  double inlier_share = 1;  ///< points within the inlier band over all candidates
  std::int32_t points = 0;  ///< candidates
  double confidence = 1;    ///< 0 to 1, the least of centre and axes; 1 where given
};

/// A skeleton whose every joint has its centre (`Joint::center` is filled, whatever the rule was).
struct Rig {
  Skeleton skeleton;
  std::vector<JointFit> fits;  ///< one per joint
};

}  // namespace ecorche
