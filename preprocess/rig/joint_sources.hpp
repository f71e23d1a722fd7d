// SPDX-License-Identifier: Apache-2.0
// Points and directions of the body out of their rules (core/values/joint_rule.hpp).
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "preprocess/rig/bone_points.hpp"
#include "preprocess/rig/cylinder_fit.hpp"
#include "preprocess/rig/found_point.hpp"

namespace ecorche::rig {

class JointSources {
 public:
  /// Below this the next of several sources is tried, and a joint is warned of.
  static constexpr double least_confidence = 0.5;
  /// Of a direction that is said among others that are found: it stands for none.
  static constexpr double default_axis = 0.1;

  /// Both must outlive this; `skeleton` is the part of the patient's that has bones.
  JointSources(const Case& patient, const Skeleton& skeleton);

  /// Segments whose bones lie on the other side of the body than their names say: what leads from a joint of
  /// one side to that of the other leads the other way.
  void exchange(std::set<std::string> segments) { exchanged_ = std::move(segments); }

  /// The joint's centre by its rule; where that cannot be followed (bones that the case lacks, points that
  /// lie on no such shape), midway between the surfaces of segment and parent that face each other, and,
  /// where the parent has no bone, the middle of the segment's own: those with confidence 0. Throws
  /// Error{config} when the rule leads back to the joint itself.
  const FoundPoint& center(std::size_t row);

  /// The joint's axes by their rules (columns x, y, z; orthonormal, right-handed) and the least confidence of
  /// the two. A direction that cannot be followed is the axis of LPS, with confidence 0. Throws Error{config}
  /// as above, and Error{data} when the two come out within 6 degrees of a line.
  std::pair<Eigen::Matrix3d, double> axes(std::size_t row);

  /// Whose bones the joint's centre is first looked for on: a segment; empty where on none.
  std::string shown_on(std::size_t row) const;
  /// The axis (0 x, 1 y, 2 z) of a joint where a shape shows it, before anything is settled.
  std::optional<FoundDirection> shown_axis(std::size_t row, int axis);
  /// Whether the joint's axis should cross a shaft, and its parent's bones are too short to show one.
  bool lacks_shaft(std::size_t row);
  /// All bones of a segment.
  const SurfaceMesh& bones(const std::string& segment) { return bones_.segment(segment); }
  /// What was found for the joint and not used, since `JointRule::possible` leaves it out: lines without its
  /// name.
  const std::vector<std::string>& notes(std::size_t row) const { return notes_[row]; }

  /// In place of what the rules find, from now on: a joint's centre, one axis (the rule's other one stays
  /// perpendicular to it), or all axes. What was made of others is found again.
  void settle(std::size_t row, const FoundPoint& center);
  void settle_axis(std::size_t row, int axis, const FoundDirection& along);
  void settle_axes(std::size_t row, const Eigen::Matrix3d& axes, double confidence);

 private:
  const JointRule* rule_of(int row) const;
  // Where a rule first fits an axis to bones; null where it does not.
  static const DirectionSource* first_fit(const DirectionSource& source);
  bool possible_radius(double radius);
  // Whether the joint that is being found may turn about it.
  bool crosses_shaft(const Eigen::Vector3d& axis);
  // On a bone without a shaft, whose end a cylinder fits every way: whether the axis is about the one that
  // the rule says.
  bool near_said(const JointRule& how, const Eigen::Vector3d& axis);
  // A direction that is only said, perpendicular to the shaft that it should cross.
  Eigen::Vector3d across_shaft(const Eigen::Vector3d& said);
  std::optional<Eigen::Vector3d> shaft(int row);
  std::optional<Eigen::Vector3d> shaft_of(const std::string& segment);
  // Of the joint that is being found: the shaft that its axis crosses, its parent's, else its own segment's.
  std::optional<Eigen::Vector3d> crossed_shaft();
  // The most that what was fitted to its bones is sure.
  double most_of_fit();
  bool leads_across_exchanged(const DirectionSource& source) const;
  void note(std::string line);
  void forget();
  std::vector<PointSource> without_ends(const std::vector<PointSource>& parts) const;

  const FoundPoint& found(std::size_t row) const { return *centers_[row]; }
  const std::optional<CylinderFit>& cylinder(const SurfacePoints& points);
  std::optional<FoundPoint> point(const PointSource& source);
  std::optional<FoundPoint> fitted(CenterRule rule, const RegionUse& on);
  std::optional<FoundPoint> between(const PointSource& source);
  std::optional<FoundPoint> by_rule(const Joint& joint);
  std::pair<Eigen::Matrix3d, double> find_axes(std::size_t row);
  FoundPoint by_proximity(const Segment& segment);
  // Of several choices none that lies along `beside` (zero: nothing does).
  std::optional<FoundDirection> direction(const DirectionSource& source, int axis,
                                          const Eigen::Vector3d& beside);
  std::optional<FoundDirection> fitted_axis(const DirectionSource& source);
  std::optional<FoundDirection> axis_of(const std::string& joint, int axis);

  const Skeleton& skeleton_;
  BonePoints bones_;
  std::vector<std::optional<FoundPoint>> centers_;
  std::vector<std::optional<std::pair<Eigen::Matrix3d, double>>> axes_;
  std::vector<std::optional<FoundPoint>> settled_;
  std::vector<std::optional<std::pair<Eigen::Matrix3d, double>>> settled_axes_;
  std::map<std::pair<std::size_t, int>, FoundDirection> settled_axis_;
  std::vector<std::vector<std::string>> notes_;
  std::set<std::string> exchanged_;
  double scale_ = 1;  // of the body, over an adult's
  int bounded_ = -1;  // the joint that is being found: its bounds hold
  /// By the points' own place: centre and axis of a joint ask alike.
  std::map<const SurfacePoints*, std::optional<CylinderFit>> cylinders_;
  std::vector<bool> open_center_, open_axes_;  // being worked out: rules that meet one again go in a circle
};

}  // namespace ecorche::rig
