// SPDX-License-Identifier: Apache-2.0
// What is not used of what bones show, and what stands in for it.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "core/linear/decompositions.hpp"
#include "preprocess/rig/joint_sources.hpp"
#include "preprocess/rig/other_side.hpp"

namespace ecorche::rig {
namespace {

constexpr double kLongShaft = 4;  // a shaft's variance, in variances across it
constexpr double kStump = 0.45;   // the most that a fit to a bone without a shaft is sure
constexpr double kStumpOff = 20;  // degrees, and off the direction that the rule says: a leg turns by less

// The first place that a source looks at; nothing where it looks at none.
const RegionUse* first_use(const PointSource& source) {
  const RegionUse& on = source.on;
  if (!on.region.empty() || !on.bone.empty() || !on.segment.empty()) return &on;
  for (const PointSource& part : source.parts) {
    if (const RegionUse* use = first_use(part)) return use;
  }
  return nullptr;
}

}  // namespace

bool JointSources::possible_radius(double radius) {
  const JointRule* how = rule_of(bounded_);
  if (how == nullptr || how->possible.radius_mm.holds(radius / scale_)) return true;
  std::ostringstream line;
  line.precision(3);
  line << "a sphere of radius " << radius << " mm on its bones is not used: possible are "
       << scale_ * how->possible.radius_mm.least << " to " << scale_ * how->possible.radius_mm.most;
  if (scale_ != 1) line << " in a body of " << std::lround(100 * scale_) << " % of an adult's size";
  note(line.str());
  return false;
}

std::optional<Eigen::Vector3d> JointSources::shaft(int row) {
  if (row < 0) return std::nullopt;
  const int parent = skeleton_.segments[static_cast<std::size_t>(row)].parent;
  if (parent < 0) return std::nullopt;
  return shaft_of(skeleton_.segments[static_cast<std::size_t>(parent)].name);
}

std::optional<Eigen::Vector3d> JointSources::shaft_of(const std::string& segment) {
  const Points& V = bones_.segment(segment).V;
  if (V.rows() < 4) return std::nullopt;
  const Points from = V.rowwise() - V.colwise().mean();
  const linear::SymmetricEigen axes = linear::symmetric_eigen(from.transpose() * from);
  if (axes.values[2] <= kLongShaft * axes.values[1]) return std::nullopt;
  return Eigen::Vector3d(axes.vectors.col(2));
}

std::optional<Eigen::Vector3d> JointSources::crossed_shaft() {
  auto parents = shaft(bounded_);
  if (parents || bounded_ < 0) return parents;
  return shaft_of(skeleton_.segments[static_cast<std::size_t>(bounded_)].name);
}

double JointSources::most_of_fit() {
  if (bounded_ < 0 || !lacks_shaft(static_cast<std::size_t>(bounded_))) return 1;
  note(
      "its bone is too short to show a shaft that the axis crosses: what is fitted to it has confidence 45 % "
      "at most");
  return kStump;
}

bool JointSources::lacks_shaft(std::size_t row) {
  const JointRule* how = rule_of(static_cast<int>(row));
  return how != nullptr && !how->possible.axis_to_shaft.any() && !shaft(static_cast<int>(row));
}

bool JointSources::near_said(const JointRule& how, const Eigen::Vector3d& axis) {
  const DirectionSource* fit = nullptr;
  for (const auto& [letter, source] : how.axes) {
    if (fit == nullptr) fit = first_fit(source);
  }
  if (fit == nullptr || fit->direction.isZero()) return true;
  const double cosine = std::abs(fit->direction.normalized().dot(axis));
  const double off = std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi;
  if (off <= kStumpOff) return true;
  std::ostringstream line;
  line << "an axis " << std::lround(off) << " degrees off the one that its rule says, on a bone too short to "
       << "show its shaft, is not used: possible are " << kStumpOff;
  note(line.str());
  return false;
}

bool JointSources::crosses_shaft(const Eigen::Vector3d& axis) {
  const JointRule* how = rule_of(bounded_);
  if (how == nullptr || how->possible.axis_to_shaft.any()) return true;
  if (!shaft(bounded_) && !near_said(*how, axis)) return false;
  const auto along = crossed_shaft();
  if (!along) return true;
  // Neither has a side: what is possible is so from either.
  const double angle = std::acos(std::clamp(along->dot(axis), -1.0, 1.0));
  const auto& possible = how->possible.axis_to_shaft;
  if (possible.holds(angle) || possible.holds(std::numbers::pi - angle)) return true;
  std::ostringstream line;
  line << "an axis " << std::lround(angle * 180 / std::numbers::pi)
       << " degrees to the shaft is not used: possible are "
       << std::lround(possible.least * 180 / std::numbers::pi) << " to "
       << std::lround(possible.most * 180 / std::numbers::pi);
  note(line.str());
  return false;
}

Eigen::Vector3d JointSources::across_shaft(const Eigen::Vector3d& said) {
  const JointRule* how = rule_of(bounded_);
  const auto along = how == nullptr || how->possible.axis_to_shaft.any() ? std::nullopt : crossed_shaft();
  if (!along) return said;
  const Eigen::Vector3d across = said - *along * along->dot(said);
  return across.norm() > 0.5 ? Eigen::Vector3d(across.normalized()) : said;
}

bool JointSources::leads_across_exchanged(const DirectionSource& source) const {
  if (exchanged_.empty() || source.from.joint.empty()) return false;
  if (other_side(source.from.joint) != source.to.joint) return false;
  const int row = skeleton_.find_joint(source.from.joint);
  return row >= 0 && exchanged_.contains(skeleton_.segments[static_cast<std::size_t>(row)].name);
}

void JointSources::note(std::string line) {
  std::vector<std::string>& notes = notes_[static_cast<std::size_t>(bounded_)];
  if (std::find(notes.begin(), notes.end(), line) == notes.end()) notes.push_back(std::move(line));
}

void JointSources::settle(std::size_t row, const FoundPoint& center) {
  settled_[row] = center;
  settled_[row]->fit.joint = skeleton_.segments[row].joint.name;
  forget();
}

void JointSources::settle_axis(std::size_t row, int axis, const FoundDirection& along) {
  settled_axis_[{row, axis}] = along;
  forget();
}

void JointSources::settle_axes(std::size_t row, const Eigen::Matrix3d& axes, double confidence) {
  settled_axes_[row] = std::pair(axes, confidence);
  forget();
}

void JointSources::forget() {
  centers_ = settled_;
  axes_ = settled_axes_;
}

std::string JointSources::shown_on(std::size_t row) const {
  const JointRule* how = rule_of(static_cast<int>(row));
  const RegionUse* use = how == nullptr ? nullptr : first_use(how->center);
  if (use == nullptr) return "";
  return use->region.empty() ? use->segment : bones_.segment_of(use->region);
}

}  // namespace ecorche::rig
