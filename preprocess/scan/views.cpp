// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/views.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/linear/decompositions.hpp"
#include "preprocess/scan/fit_segments.hpp"

namespace ecorche::scan {
namespace {

constexpr double kRaised = 165 * std::numbers::pi / 180;

bool starts(const std::string& name, std::string_view with) {
  return name.starts_with(with);
}

}  // namespace

bool of_arm(const std::string& name) {
  return starts(name, "upper_arm") || starts(name, "forearm") || starts(name, "hand");
}

std::string without_side(const std::string& name) {
  for (const std::string_view side : {"_left", "_right"}) {
    if (name.ends_with(side)) return name.substr(0, name.size() - side.size());
  }
  return name;
}

bool view_has(View view, const std::string& segment) {
  const bool leg = starts(segment, "thigh") || starts(segment, "shank") || starts(segment, "foot") ||
                   starts(segment, "toes");
  switch (view) {
    case View::body:
    case View::arms_up:
      break;
    case View::leg_left:
      return leg && segment.ends_with("_left");
    case View::leg_right:
      return leg && segment.ends_with("_right");
    case View::arm_left:
      return of_arm(segment) && segment.ends_with("_left");
    case View::arm_right:
      return of_arm(segment) && segment.ends_with("_right");
  }
  return true;
}

std::vector<Similarity> held_by(const BodyTemplate& body, View view) {
  std::vector<Similarity> out(body.segments.size());
  if (view != View::arms_up) return out;
  for (std::size_t s = 0; s < out.size(); ++s) {
    const TemplateSegment& segment = body.segments[s];
    if (!of_arm(segment.name)) continue;
    const bool parent_too =
        segment.parent >= 0 && of_arm(body.segments[static_cast<std::size_t>(segment.parent)].name);
    if (parent_too) {
      out[s] = out[static_cast<std::size_t>(segment.parent)];
      continue;
    }
    const double side = segment.name.ends_with("_left") ? -1 : 1;
    out[s].rotation = Eigen::AngleAxisd(side * kRaised, Eigen::Vector3d::UnitY()).toRotationMatrix();
    out[s].shift = segment.joint - out[s].rotation * segment.joint;
  }
  return out;
}

Placed laid(const BodyTemplate& body, const Similarity& place, View view) {
  Placed out;
  out.view = view;
  out.scale = place.scale;
  for (const Similarity& held : held_by(body, view)) out.segments.push_back(place.after(held));
  for (const TemplateSegment& segment : body.segments)
    out.in_play.push_back(view_has(view, segment.name) ? 1 : 0);
  return out;
}

Placed with_other_arms(const BodyTemplate& body, Placed placed) {
  if (one_limb(placed.view) || placed.segments.size() != body.segments.size()) return placed;
  placed.view = placed.view == View::body ? View::arms_up : View::body;
  const std::vector<Similarity> held = held_by(body, placed.view);
  std::vector<std::size_t> carrier(body.segments.size());  // of an arm's segment: what the arm hangs on
  for (std::size_t s = 0; s < carrier.size(); ++s) {
    carrier[s] = s;
    const int parent = body.segments[s].parent;
    if (!of_arm(body.segments[s].name) || parent < 0) continue;
    carrier[s] = carrier[static_cast<std::size_t>(parent)];
    placed.segments[s] = placed.segments[carrier[s]].after(held[s]);
  }
  return placed;
}

bool of_upper_arm(const BodyTemplate& body, const TemplateBone& bone) {
  return starts(body.segments[static_cast<std::size_t>(bone.segment)].name, "upper_arm");
}

bool upper_arm_in_view(const BodyTemplate& body, const Placed& placed, const ImageGrid& grid) {
  if (placed.segments.size() != body.segments.size()) return false;
  return std::any_of(body.bones.begin(), body.bones.end(), [&](const TemplateBone& bone) {
    const Similarity& at = placed.segments[static_cast<std::size_t>(bone.segment)];
    return of_upper_arm(body, bone) && in_view(grid, at(bone.points.colwise().mean().transpose()));
  });
}

std::vector<std::pair<Eigen::Matrix3d, Eigen::Vector3d>> turns_of(View view, const Points& own_points,
                                                                  const Points& theirs_points) {
  std::vector<std::pair<Eigen::Matrix3d, Eigen::Vector3d>> out;
  if (!one_limb(view)) {
    out.emplace_back(Eigen::Matrix3d::Identity(), Eigen::Vector3d::UnitZ());
    return out;
  }
  const auto axis_of = [](const Points& points) -> Eigen::Vector3d {
    const Points centred = points.rowwise() - points.colwise().mean();
    return linear::symmetric_eigen(centred.transpose() * centred).vectors.col(2);
  };
  const Eigen::Vector3d own = axis_of(own_points);
  Eigen::Vector3d theirs = axis_of(theirs_points);
  if (theirs.z() * own.z() < 0) theirs = -theirs;
  const bool arm = view == View::arm_left || view == View::arm_right;
  for (const double sign : {1.0, -1.0}) {
    if (!arm && sign < 0 && std::abs(theirs.z()) > 0.5) continue;  // legs point down
    const Eigen::Matrix3d onto = linear::turn_between(own, sign * theirs).toRotationMatrix();
    for (int spin = 0; spin < 4; ++spin) {
      const double angle = spin * std::numbers::pi / 2;
      out.emplace_back(Eigen::AngleAxisd(angle, theirs).toRotationMatrix() * onto, theirs);
    }
  }
  return out;
}

std::vector<View> views_of(Side side) {
  if (side == Side::left) return {View::leg_left, View::arm_left};
  if (side == Side::right) return {View::leg_right, View::arm_right};
  return {View::body, View::arms_up, View::leg_left, View::leg_right, View::arm_left, View::arm_right};
}

std::string_view view_name(View view) {
  switch (view) {
    case View::body:
      return "the body, arms hanging";
    case View::arms_up:
      return "the body, arms raised";
    case View::leg_left:
      return "a left leg";
    case View::leg_right:
      return "a right leg";
    case View::arm_left:
      return "a left arm";
    case View::arm_right:
      break;
  }
  return "a right arm";
}

}  // namespace ecorche::scan
