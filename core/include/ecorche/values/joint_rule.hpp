// SPDX-License-Identifier: Apache-2.0
// Where joints come from: named regions of bones, shapes fitted to them, and the points and directions made
// of those (Sujar18 3.1).
#pragma once

#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche {

/// A named part of a bone's surface. Exactly one of `bone` and `segment` is named.
struct Region {
  std::string name;
  std::string bone;     ///< of the case
  std::string segment;  ///< all its bones together
  /// Vertices within any of these; LPS mm, or shares (0 to 1) of the bones' own box along LPS where
  /// `of_bones`, or widths of the bone's end nearest to segment `near` in the frame of that end
  /// (preprocess/rig/bone_end.hpp), where it is named.
  std::vector<Eigen::AlignedBox3d> boxes;
  bool of_bones = false;
  std::string near;
  /// Beside `near`: the axis of a cylinder is within 60 degrees of this direction of that frame; zero: any.
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  Points points = Points(0, 3);  ///< LPS mm; each stands for the vertex nearest to it
};

/// Which vertices a shape is fitted to: those of a region; or of a bone, or of all bones of a segment, all or
/// those that face another (found by proximity).
struct RegionUse {
  std::string region;
  std::string bone, facing;
  std::string segment, facing_segment;
  /// Of those that face another, only the ones whose normal is within 60 degrees of this direction, LPS;
  /// zero: all.
  Eigen::Vector3d looks = Eigen::Vector3d::Zero();
  /// Of those that face another, the axis of a cylinder through them is within 60 degrees of this direction
  /// of that bone's end (as `Region::along`); zero: any.
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
};

/// A point of the body.
struct PointSource {
  CenterRule rule = CenterRule::given;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< LPS mm, where `given`
  RegionUse on;                                     ///< of the fits and the centroid
  std::vector<PointSource> parts;  ///< the two ends of `between`, or what `first_good` chooses from
  double share = 0.5;              ///< of the way from the first end to the second
  std::string joint;               ///< whose centre, where `joint`
};

/// A direction of the body.
struct DirectionSource {
  /// Where it comes from.
  enum class Kind : std::uint8_t {
    given,       ///< `direction`
    fit,         ///< the axis of a cylinder, the normal of a plane or of an ellipse: `from.rule` on `from.on`
    towards,     ///< from `from` to `to`
    axis_of,     ///< the axis with the same letter of joint `joint`
    first_good,  ///< of `choices`
  };
  Kind kind = Kind::given;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< LPS; of a fit: the side that its axis points to
  PointSource from, to;
  std::string joint;
  std::vector<DirectionSource> choices;
};

/// What anatomy allows at a joint; no bound by default.
struct JointBounds {
  /// Both ends included.
  struct Range {
    double least = -std::numeric_limits<double>::infinity();
    double most = std::numeric_limits<double>::infinity();
    /// Whether `x` lies within.
    bool holds(double x) const { return x >= least && x <= most; }
    /// Whether it bounds nothing.
    bool any() const {
      return !(least > -std::numeric_limits<double>::infinity()) &&
             !(most < std::numeric_limits<double>::infinity());
    }
  };
  Range radius_mm;      ///< of a sphere that the centre is found on
  Range axis_to_shaft;  ///< radians, 0 to pi: from the parent bone's shaft, pointing up, to a hinge's axis
  std::vector<std::pair<std::string, Range>> rest;  ///< radians, by angle: as a body can be scanned
  std::string source;

  /// Whether it bounds nothing.
  bool none() const { return radius_mm.any() && axis_to_shaft.any() && rest.empty() && source.empty(); }
};

/// How long a body can be: its skin's longest extent, mm.
struct BodySize {
  double least = 0, most = 0;  ///< of any part of a body
  double whole = 0;            ///< the least of one that has bones in three of four segments
  std::string source;
};

/// How a joint's center and axes are found.
struct JointRule {
  PointSource center;
  /// Axis (0 x, 1 y, 2 z) and where it comes from: the first keeps its direction, the second is made
  /// perpendicular to it, their cross product is the third. Empty: `Joint::axes` are given.
  std::vector<std::pair<int, DirectionSource>> axes;
  /// The rest angles are those from the parent's axes to this joint's, instead of `AngleAxis::rest`.
  bool measured_rest = false;
  JointBounds possible;  ///< what is found outside of these is not used
};

/// As skeleton files, `info` and `verify` name a rule.
inline constexpr std::array<std::string_view, 10> center_rule_names{
    "given",    "sphere_fit", "cylinder_fit", "plane_fit", "ellipse_fit",
    "centroid", "between",    "joint",        "any",       "facing"};

inline std::string_view center_rule_name(CenterRule rule) {
  return center_rule_names.at(static_cast<std::size_t>(rule));
}

}  // namespace ecorche
