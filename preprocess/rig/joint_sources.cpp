// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/joint_sources.hpp"

#include <algorithm>
#include <cmath>

#include <ecorche/values/error.hpp>
#include "preprocess/rig/axle_fit.hpp"
#include "preprocess/rig/body_scale.hpp"
#include "preprocess/rig/ellipse_fit.hpp"
#include "preprocess/rig/facing.hpp"
#include "preprocess/rig/plane_fit.hpp"
#include "preprocess/rig/sphere_fit.hpp"
#include "preprocess/rig/vertex_order.hpp"

namespace ecorche::rig {
namespace {

constexpr double kLeastSine = 0.1;  // two directions closer to a line (6 degrees) say nothing of the third

// All of the bones that a part was found on; nothing of a region's.
RegionUse whole(const RegionUse& part) {
  RegionUse out;
  out.bone = part.bone;
  out.segment = part.segment;
  return out;
}

[[noreturn]] void circle(const std::string& joint) {
  throw Error(ErrorKind::config, "joint " + joint, "its rule leads back to the joint itself",
              "break the circle");
}

// Marks a joint as being worked out, until the end of the scope.
class Open {
 public:
  Open(std::vector<bool>& open, std::size_t row, const std::string& joint) : open_(open), row_(row) {
    if (open_[row_]) circle(joint);
    open_[row_] = true;
  }
  ~Open() { open_[row_] = false; }
  Open(const Open&) = delete;
  Open& operator=(const Open&) = delete;

 private:
  std::vector<bool>& open_;
  std::size_t row_;
};

// Says whose bounds hold for what is found, until the end of the scope.
class Bounded {
 public:
  Bounded(int& bounded, std::size_t row) : bounded_(bounded), before_(bounded) {
    bounded_ = static_cast<int>(row);
  }
  ~Bounded() { bounded_ = before_; }
  Bounded(const Bounded&) = delete;
  Bounded& operator=(const Bounded&) = delete;

 private:
  int& bounded_;
  int before_;
};

// The first source that is good, else the best.
template <class Found, class Sources, class Find, class Confidence>
std::optional<Found> first_good(const Sources& sources, Find&& find, Confidence&& confidence) {
  std::optional<Found> best;
  for (const auto& source : sources) {
    std::optional<Found> found = find(source);
    if (!found) continue;
    const double known = confidence(*found);
    if (known >= JointSources::least_confidence) return found;
    if (!best || known > confidence(*best)) best = std::move(found);
  }
  return best;
}

// Never beside nothing, the zero vector.
bool collinear(const Eigen::Vector3d& unit, const Eigen::Vector3d& beside) {
  return !beside.isZero() && unit.cross(beside).norm() < kLeastSine;
}

Eigen::Vector3d mean(const Points& points) {
  return points.colwise().mean().transpose();
}

}  // namespace

JointSources::JointSources(const Case& patient, const Skeleton& skeleton)
    : skeleton_(skeleton),
      bones_(patient),
      centers_(skeleton.segments.size()),
      axes_(skeleton.segments.size()),
      settled_(skeleton.segments.size()),
      settled_axes_(skeleton.segments.size()),
      notes_(skeleton.segments.size()),
      scale_(body_scale(patient)),
      open_center_(skeleton.segments.size()),
      open_axes_(skeleton.segments.size()) {}

const JointRule* JointSources::rule_of(int row) const {
  return row < 0 ? nullptr : skeleton_.segments[static_cast<std::size_t>(row)].joint.how.get();
}

const DirectionSource* JointSources::first_fit(const DirectionSource& source) {
  if (source.kind == DirectionSource::Kind::fit) return &source;
  for (const DirectionSource& choice : source.choices) {
    if (const DirectionSource* fit = first_fit(choice)) return fit;
  }
  return nullptr;
}

std::optional<FoundDirection> JointSources::shown_axis(std::size_t row, int axis) {
  const JointRule* how = rule_of(static_cast<int>(row));
  if (how == nullptr) return std::nullopt;
  const Bounded bounded(bounded_, row);
  for (const auto& [letter, source] : how->axes) {
    if (letter == axis && first_fit(source) != nullptr)
      return direction(source, axis, Eigen::Vector3d::Zero());
  }
  return std::nullopt;
}

const std::optional<CylinderFit>& JointSources::cylinder(const SurfacePoints& points) {
  const auto [entry, fresh] = cylinders_.try_emplace(&points);
  if (fresh) {
    const SurfacePoints left = as_left(points);
    entry->second = left.found ? fit_axle(left) : fit_cylinder(left.at);
    if (entry->second) entry->second = from_left(*entry->second, points);
  }
  return entry->second;
}

std::optional<FoundPoint> JointSources::fitted(CenterRule rule, const RegionUse& on) {
  const SurfacePoints& surface = bones_.of(on);
  if (surface.at.rows() == 0) return std::nullopt;
  const Points points = as_left(surface).at;
  std::optional<FoundPoint> found;
  switch (rule) {
    case CenterRule::sphere_fit:
      if (auto fit = fit_sphere(points)) {
        *fit = from_left(*fit, surface);
        if (surface.found) *fit = grown_sphere(bones_.of(whole(on)), *fit);
        if (!possible_radius(fit->radius)) return std::nullopt;
        found = fitted_point(rule, *fit, fit->radius, surface);
      }
      return found;
    case CenterRule::cylinder_fit:
      if (const auto& fit = cylinder(surface); fit && crosses_shaft(fit->axis)) {
        found = fitted_point(rule, *fit, fit->radius, surface);
        found->axis = fit->axis;
        found->fit.confidence = std::min(found->fit.confidence, most_of_fit());
      }
      return found;
    case CenterRule::plane_fit:
      if (const auto fit = fit_plane(points)) {
        found = fitted_point(rule, from_left(*fit, surface), 0, surface);
        found->axis = from_left(*fit, surface).normal;
        found->fit.confidence *= plate_confidence(points, fit->rows);
      }
      return found;
    case CenterRule::ellipse_fit:
      if (const auto fit = fit_ellipse(points)) {
        found = fitted_point(rule, from_left(*fit, surface), 0.5 * (fit->long_mm + fit->short_mm), surface);
        found->axis = from_left(*fit, surface).normal;
      }
      return found;
    default:
      return centroid_of(surface);
  }
}

std::optional<FoundPoint> JointSources::between(const PointSource& source) {
  const auto a = point(source.parts[0]), b = point(source.parts[1]);
  if (!a || !b) return std::nullopt;
  FoundPoint out = said_point(a->at + source.share * (b->at - a->at));
  out.fit.rule = CenterRule::between;
  out.fit.residual_mm = std::max(a->fit.residual_mm, b->fit.residual_mm);
  out.fit.inlier_share = std::min(a->fit.inlier_share, b->fit.inlier_share);
  out.fit.points = a->fit.points + b->fit.points;
  out.fit.confidence = std::min(a->fit.confidence, b->fit.confidence);
  out.on = a->on;
  out.on.insert(out.on.end(), b->on.begin(), b->on.end());
  return out;
}

// One end of a `between` that can be followed does not stand for it, however badly the other end is known: a
// root amid two hips would lie at the better one.
std::vector<PointSource> JointSources::without_ends(const std::vector<PointSource>& parts) const {
  std::vector<std::string> ends;
  for (const PointSource& part : parts) {
    const bool both = part.rule == CenterRule::between &&
                      std::all_of(part.parts.begin(), part.parts.end(), [&](const PointSource& end) {
                        return end.rule == CenterRule::joint && skeleton_.find_joint(end.joint) >= 0;
                      });
    for (std::size_t end = 0; both && end < part.parts.size(); ++end) ends.push_back(part.parts[end].joint);
  }
  std::vector<PointSource> out;
  for (const PointSource& part : parts) {
    const bool is_end =
        part.rule == CenterRule::joint && std::find(ends.begin(), ends.end(), part.joint) != ends.end();
    if (!is_end) out.push_back(part);
  }
  return out;
}

std::optional<FoundPoint> JointSources::point(const PointSource& source) {
  switch (source.rule) {
    case CenterRule::given:
      return said_point(source.point);
    case CenterRule::between:
      return between(source);
    case CenterRule::joint: {
      const int row = skeleton_.find_joint(source.joint);
      if (row < 0) return std::nullopt;
      FoundPoint other = center(static_cast<std::size_t>(row));
      other.fit.rule = CenterRule::joint;
      return other;
    }
    case CenterRule::first_good:
      return first_good<FoundPoint>(
          without_ends(source.parts), [&](const PointSource& part) { return point(part); },
          [](const FoundPoint& found) { return found.fit.confidence; });
    default:
      return fitted(source.rule, source.on);
  }
}

std::optional<FoundPoint> JointSources::by_rule(const Joint& joint) {
  if (joint.how) return point(joint.how->center);
  if (joint.rule == CenterRule::given) return said_point(joint.center);
  if (joint.rule != CenterRule::sphere_fit) return std::nullopt;
  RegionUse on;
  on.bone = joint.center_bone;
  on.facing = joint.facing_bone;
  return fitted(CenterRule::sphere_fit, on);
}

FoundPoint JointSources::by_proximity(const Segment& segment) {
  FoundPoint out;
  out.fit.rule = CenterRule::facing;
  out.fit.confidence = 0;
  const SurfaceMesh& own = bones_.segment(segment.name);
  if (own.V.rows() > 0) out.at = mean(own.V);
  if (segment.parent < 0) return out;
  const SurfaceMesh& parent =
      bones_.segment(skeleton_.segments[static_cast<std::size_t>(segment.parent)].name);
  const Points here = facing_vertices(own, parent), there = facing_vertices(parent, own);
  if (here.rows() > 0 && there.rows() > 0) out.at = 0.5 * (mean(here) + mean(there));
  out.fit.points = static_cast<std::int32_t>(here.rows() + there.rows());
  return out;
}

const FoundPoint& JointSources::center(std::size_t row) {
  if (centers_[row]) return found(row);
  const Segment& segment = skeleton_.segments[row];
  const Open open(open_center_, row, segment.joint.name);
  const Bounded bounded(bounded_, row);
  const std::optional<FoundPoint> by = by_rule(segment.joint);
  centers_[row] = by ? *by : by_proximity(segment);
  centers_[row]->fit.joint = segment.joint.name;
  return found(row);
}

std::optional<FoundDirection> JointSources::fitted_axis(const DirectionSource& source) {
  const SurfacePoints& surface = bones_.of(source.from.on);
  if (surface.at.rows() == 0) return std::nullopt;
  const Points points = as_left(surface).at;
  FoundDirection out;
  if (source.from.rule == CenterRule::cylinder_fit) {
    const auto& fit = cylinder(surface);
    if (!fit || !crosses_shaft(fit->axis)) return std::nullopt;
    out = {fit->axis, std::min(fit->confidence, most_of_fit())};
  } else if (source.from.rule == CenterRule::plane_fit) {
    const auto fit = fit_plane(points);
    if (!fit) return std::nullopt;
    out = {from_left(*fit, surface).normal, fit->confidence};
  } else {
    const auto fit = fit_ellipse(points);
    if (!fit) return std::nullopt;
    out = {from_left(*fit, surface).normal, fit->confidence};
  }
  if (out.along.dot(source.direction) < 0) out.along = -out.along;
  return out;
}

std::optional<FoundDirection> JointSources::axis_of(const std::string& joint, int axis) {
  const int row = skeleton_.find_joint(joint);
  if (row < 0) return std::nullopt;
  const auto [frame, confidence] = axes(static_cast<std::size_t>(row));
  return FoundDirection{frame.col(axis), confidence};
}

std::optional<FoundDirection> JointSources::direction(const DirectionSource& source, int axis,
                                                      const Eigen::Vector3d& beside) {
  using Kind = DirectionSource::Kind;
  switch (source.kind) {
    case Kind::given:
      return FoundDirection{source.direction, 1};
    case Kind::fit:
      return fitted_axis(source);
    case Kind::axis_of:
      return axis_of(source.joint, axis);
    case Kind::first_good:
      return first_good<FoundDirection>(
          source.choices,
          [&](const DirectionSource& choice) {
            auto found = direction(choice, axis, beside);
            if (found && collinear(found->along, beside)) found.reset();
            if (found && choice.kind == Kind::given) {
              found->confidence = default_axis;
              found->along = across_shaft(found->along);
            }
            return found;
          },
          [](const FoundDirection& found) { return found.confidence; });
    case Kind::towards:
      break;
  }
  const auto from = point(source.from), to = point(source.to);
  if (!from || !to || (to->at - from->at).norm() < 1e-6) return std::nullopt;
  const double length = (to->at - from->at).norm();
  Eigen::Vector3d along = (to->at - from->at) / length;
  if (leads_across_exchanged(source)) along = -along;
  const double off = off_across(*from, along) + off_across(*to, along);
  return FoundDirection{along, angle_confidence(off / length)};
}

std::pair<Eigen::Matrix3d, double> JointSources::axes(std::size_t row) {
  if (!axes_[row]) axes_[row] = find_axes(row);
  return *axes_[row];
}

std::pair<Eigen::Matrix3d, double> JointSources::find_axes(std::size_t row) {
  const Joint& joint = skeleton_.segments[row].joint;
  if (!joint.how || joint.how->axes.empty()) return {joint.axes, 1};
  const Open open(open_axes_, row, joint.name);
  const Bounded bounded(bounded_, row);
  double confidence = 1;
  const auto found = [&](const std::pair<int, DirectionSource>& said,
                         const Eigen::Vector3d& beside) -> Eigen::Vector3d {
    auto along = direction(said.second, said.first, beside);
    const auto settled = settled_axis_.find({row, said.first});
    if (settled != settled_axis_.end() && !collinear(settled->second.along, beside)) along = settled->second;
    confidence = std::min(confidence, along ? along->confidence : 0);
    return along ? along->along : Eigen::Vector3d::Unit(said.first);
  };
  const auto& [first, second] = std::pair(joint.how->axes[0], joint.how->axes[1]);
  const int last = 3 - first.first - second.first;
  Eigen::Matrix3d frame;
  frame.col(first.first) = found(first, Eigen::Vector3d::Zero());
  const Eigen::Vector3d other = found(second, frame.col(first.first));
  const Eigen::Vector3d across = other - frame.col(first.first) * frame.col(first.first).dot(other);
  if (collinear(other, frame.col(first.first))) {
    throw Error(ErrorKind::data, "joint " + joint.name, "its two axes come out collinear",
                "take them from other regions, or give them");
  }
  frame.col(second.first) = across.normalized();
  const double turn = second.first == (first.first + 1) % 3 ? 1 : -1;
  frame.col(last) = turn * frame.col(first.first).cross(frame.col(second.first));
  return {frame, confidence};
}

}  // namespace ecorche::rig
