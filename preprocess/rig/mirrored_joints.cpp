// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/mirrored_joints.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

#include <ecorche/kinematics/angles.hpp>
#include "core/values/degrees.hpp"
#include "preprocess/rig/other_side.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Vector3d;

constexpr double kApart = 10, kTurned = 10;  // mm, degrees: what bench/rig_damage calls bad
constexpr double kCut = 0.9;                 // of the other's length: sides differ by a few hundredths
constexpr double kHalved = 0.8;              // of the other's surface: no more is there of a bone cut along
constexpr double kAsLong = 0.95;             // of the other's extent: no need to lay them onto each other
constexpr double kSurer = 2, kLeastShown = 0.2;  // so many times as sure as the other, and so sure, will do
constexpr double kMirrored = 0.4, kTurnedBack = 0.3, kAssumed = 0.1;
constexpr double kDisagree = 0.45;  // the most that either of two sides is sure that disagree

std::string degrees(double radians) {
  return std::to_string(std::lround(radians * degrees_per_radian));
}

// Whether a direction leads from a point to another, or is one that first tries that.
bool leads_along(const DirectionSource& source) {
  if (source.kind == DirectionSource::Kind::first_good)
    return !source.choices.empty() && leads_along(source.choices.front());
  return source.kind == DirectionSource::Kind::towards;
}

// One side's joint as the bones show it.
struct Shown {
  std::size_t row = 0;
  std::string bones;  // the segment on whose bones it is found
  Vector3d center = Vector3d::Zero(), axis = Vector3d::Zero();
  double confidence = 0;
};

class Pairs {
 public:
  Pairs(const Skeleton& skeleton, JointSources& sources, const Context& context)
      : skeleton_(skeleton), sources_(sources), context_(context) {}

  void run() {
    std::vector<std::pair<std::size_t, std::size_t>> both;
    for (std::size_t row = 0; row < skeleton_.segments.size(); ++row) {
      const Joint& left = skeleton_.segments[row].joint;
      if (!left.name.ends_with("_left") || !left.how) continue;
      const int other = skeleton_.find_joint(other_side(left.name));
      if (other < 0 || !skeleton_.segments[static_cast<std::size_t>(other)].joint.how) continue;
      both.emplace_back(row, static_cast<std::size_t>(other));
    }
    for (const auto& [left, right] : both) {
      context_.check_stop();
      compare(shown(left), shown(right));
    }
    for (const auto& [left, right] : both) {
      context_.check_stop();
      compare_along(left, right);
    }
  }

 private:
  const Joint& joint(std::size_t row) const { return skeleton_.segments[row].joint; }

  Shown shown(std::size_t row) {
    Shown out;
    out.row = row;
    out.bones = sources_.shown_on(row);
    const FoundPoint& found = sources_.center(row);
    out.center = found.at;
    out.confidence = found.fit.confidence;
    if (joint(row).sequence.empty()) return out;
    const int axis = joint(row).sequence[0].axis;
    if (const auto along = sources_.shown_axis(row, axis)) {
      out.axis = along->along;
      out.confidence = std::min(out.confidence, along->confidence);
    } else if (joint(row).kind == JointKind::hinge) {
      out.axis = sources_.axes(row).first.col(axis);
    }
    return out;
  }

  // From the longer bone's space to the shorter's.
  const std::optional<Laid>& laid(const std::string& longer, const std::string& shorter) {
    const auto [entry, fresh] = laid_.try_emplace(longer);
    if (fresh) entry->second = laid_onto(sources_.bones(longer), sources_.bones(shorter));
    return entry->second;
  }

  double length(const std::string& segment) {
    const Points& V = sources_.bones(segment).V;
    return V.rows() == 0 ? 0 : (V.colwise().maxCoeff() - V.colwise().minCoeff()).norm();
  }

  double away(const Vector3d& point, const std::string& segment) {
    const Points& V = sources_.bones(segment).V;
    return std::sqrt((V.rowwise() - point.transpose()).rowwise().squaredNorm().minCoeff());
  }

  // The bones of both sides, the shorter ones laid onto the image of the longer; nothing where they are alike
  // in length: none is cut.
  struct Cut {
    std::string longer, shorter;
    Laid lies;
  };
  std::optional<Cut> cut(const std::string& left, const std::string& right) {
    const double a = length(left), b = length(right);
    if (!(a > 0 && b > 0) || std::min(a, b) > kAsLong * std::max(a, b)) return std::nullopt;
    const auto& [longer, shorter] = a >= b ? std::pair(left, right) : std::pair(right, left);
    const auto& lies = laid(longer, shorter);
    if (!lies || lies->share >= kCut) return std::nullopt;
    return Cut{longer, shorter, *lies};
  }

  // Whether the bones of this side, the joint's own or its parent's, end before the joint, as those of the
  // other show it.
  bool ends_before(const Shown& it, const Shown& other) {
    const auto& all = skeleton_.segments;
    const auto parent = [&](const Shown& one) { return all[one.row].parent; };
    std::vector<std::pair<std::string, std::string>> both{{all[it.row].name, all[other.row].name}};
    if (parent(it) >= 0 && parent(other) >= 0)
      both.emplace_back(all[static_cast<std::size_t>(parent(it))].name,
                        all[static_cast<std::size_t>(parent(other))].name);
    for (const auto& [here, there] : both) {
      if (other_side(here) != there) continue;
      const auto by = cut(here, there);
      if (by && by->shorter == here &&
          away(by->lies.map * other.center, here) > away(other.center, there) + kApart)
        return true;
    }
    return false;
  }

  void compare(const Shown& left, const Shown& right) {
    if (left.bones.empty() || other_side(left.bones) != right.bones) return;
    const double a = length(left.bones), b = length(right.bones);
    if (!(a > 0 && b > 0)) return;
    const Shown& longer = a >= b ? left : right;
    const Shown& shorter = a >= b ? right : left;
    const auto& lies = laid(longer.bones, shorter.bones);
    if (!lies) return;
    const bool is_cut = lies->share < kCut || lies->covered < kHalved;
    const bool left_ends = ends_before(left, right), right_ends = !left_ends && ends_before(right, left);
    const bool ends = left_ends || right_ends;
    const bool shorter_is_worse =
        ends ? left_ends == (&shorter == &left) : is_cut || shorter.confidence <= longer.confidence;
    const Shown& worse = shorter_is_worse ? shorter : longer;
    const Shown& better = shorter_is_worse ? longer : shorter;
    const Eigen::Affine3d map = shorter_is_worse ? lies->map : Eigen::Affine3d(lies->map.inverse());
    const Vector3d to = map * better.center;
    // Axes point to the left on both sides: mirrored, and turned round.
    const Vector3d axis = better.axis.isZero() ? better.axis : Vector3d(-(map.linear() * better.axis));
    Vector3d off = worse.center - to;
    double turned = 0;
    if (!axis.isZero()) {
      if (joint(worse.row).kind == JointKind::hinge) off -= axis * axis.dot(off);
      turned = std::acos(std::min(1.0, std::abs(axis.dot(worse.axis)))) * degrees_per_radian;
    }
    const bool missing = worse.confidence <= 0;
    if (!missing && off.norm() <= kApart && turned <= kTurned) return;
    const bool surer = better.confidence >= kSurer * worse.confidence;
    const double enough = surer ? kLeastShown : JointSources::least_confidence;
    if (sources_.lacks_shaft(better.row) ||  // what a stump shows is no better
        (ends ? better.confidence <= 0 : better.confidence < enough)) {
      doubt(better, worse, off.norm(), turned);
      return;
    }
    const double known = std::min(kMirrored, better.confidence);
    FoundPoint found;
    found.at = to;
    found.fit = sources_.center(better.row).fit;
    found.fit.rule = CenterRule::joint;
    found.fit.confidence = known;
    std::ostringstream line;
    line << "joint " << joint(worse.row).name << ": its bones show it " << std::lround(off.norm()) << " mm";
    if (!axis.isZero()) line << " and " << std::lround(turned) << " degrees";
    line << " off the mirror image of " << joint(better.row).name;
    if (lies->share < kCut && shorter_is_worse)
      line << ", on a bone with " << std::lround(100 * lies->share) << " % of the other's length";
    line << ": it is taken from there, with confidence " << std::lround(100 * known) << " %";
    context_.warn(line.str());
    sources_.settle(worse.row, found);
    if (!axis.isZero()) sources_.settle_axis(worse.row, joint(worse.row).sequence[0].axis, {axis, known});
  }

  // Two sides that are unlike, and neither of which shows its joint well: one of both is wrong.
  void doubt(const Shown& one, const Shown& other, double mm, double turned) {
    for (const auto& [is, twin] : {std::pair(&one, &other), std::pair(&other, &one)}) {
      FoundPoint found = sources_.center(is->row);
      const double before = found.fit.confidence;
      found.fit.confidence = std::min(before, kDisagree);
      sources_.settle(is->row, found);
      if (!is->axis.isZero())
        sources_.settle_axis(is->row, joint(is->row).sequence[0].axis,
                             {is->axis, std::min(is->confidence, kDisagree)});
      if (before < JointSources::least_confidence) continue;
      std::ostringstream line;
      line << "joint " << joint(is->row).name << ": its bones show it " << std::lround(mm) << " mm and "
           << std::lround(turned) << " degrees off the mirror image of " << joint(twin->row).name
           << ", which is not sure: neither is it, with confidence " << std::lround(100 * kDisagree)
           << " % at most";
      context_.warn(line.str());
    }
  }

  // The long axis of a segment whose bones are cut leads to where they end, not to the next joint.
  void compare_along(std::size_t left, std::size_t right) {
    const auto by = cut(skeleton_.segments[left].name, skeleton_.segments[right].name);
    if (!by) return;
    const auto [worse, better] =
        by->shorter == skeleton_.segments[left].name ? std::pair(left, right) : std::pair(right, left);
    for (const auto& [axis, source] : joint(worse).how->axes) {
      if (!leads_along(source)) continue;
      const auto [frame, confidence] = sources_.axes(better);
      const Vector3d to = by->lies.map.linear() * frame.col(axis);
      const Vector3d is = sources_.axes(worse).first.col(axis);
      const double turned = std::acos(std::clamp(to.dot(is), -1.0, 1.0)) * degrees_per_radian;
      if (turned <= kTurned || confidence < kLeastShown) continue;
      const double known = std::min(kMirrored, confidence);
      std::ostringstream line;
      line << "joint " << joint(worse).name << ": its long axis leads " << std::lround(turned)
           << " degrees off the mirror image of that of " << joint(better).name << ", on a bone with "
           << std::lround(100 * by->lies.share)
           << " % of the other's length: it is taken from there, with confidence " << std::lround(100 * known)
           << " %";
      context_.warn(line.str());
      sources_.settle_axis(worse, axis, {to, known});
    }
  }

  const Skeleton& skeleton_;
  JointSources& sources_;
  const Context& context_;
  std::map<std::string, std::optional<Laid>> laid_;
};

// The anatomical angles that lead from the parent's axes to the joint's.
std::array<double, 3> rest_of(const Skeleton& skeleton, JointSources& sources, std::size_t row) {
  const Segment& segment = skeleton.segments[row];
  const Eigen::Matrix3d parent = sources.axes(static_cast<std::size_t>(segment.parent)).first;
  const Eigen::Matrix3d turn = parent.transpose() * sources.axes(row).first;
  return kinematics::angles_from_rotation(segment.joint, Eigen::Quaterniond(turn));
}

}  // namespace

void take_other_sides(const Skeleton& skeleton, JointSources& sources, const Context& context) {
  Pairs(skeleton, sources, context).run();
}

void keep_rest_possible(const Skeleton& skeleton, JointSources& sources, const Context& context) {
  for (std::size_t row = 0; row < skeleton.segments.size(); ++row) {
    const Segment& segment = skeleton.segments[row];
    const Joint& joint = segment.joint;
    if (segment.parent < 0 || !joint.how || !joint.how->measured_rest || joint.how->possible.rest.empty())
      continue;
    std::array<double, 3> rest = rest_of(skeleton, sources, row);
    double known = 1;
    std::string said;
    for (const auto& [name, range] : joint.how->possible.rest) {
      for (std::size_t a = 0; a < joint.sequence.size() && a < 3; ++a) {
        if (joint.sequence[a].name != name || range.holds(rest[a])) continue;
        const int twin = skeleton.find_joint(other_side(joint.name));
        const double other = twin < 0 ? 0 : rest_of(skeleton, sources, static_cast<std::size_t>(twin))[a];
        const bool good = twin >= 0 && range.holds(other);
        const double to = good ? other : std::clamp(0.0, range.least, range.most);
        said += (said.empty() ? "" : ", ") + name + " at " + degrees(rest[a]) + " degrees (possible are " +
                degrees(range.least) + " to " + degrees(range.most) + "; taken as " + degrees(to) +
                (good ? ", as the other side" : "") + ")";
        rest[a] = to;
        known = std::min(known, good ? kTurnedBack : kAssumed);
      }
    }
    if (said.empty()) continue;
    context.warn("joint " + joint.name + ": its bones show it resting with " + said);
    const auto [parent, of_parent] = sources.axes(static_cast<std::size_t>(segment.parent));
    const Eigen::Matrix3d turn = kinematics::rotation_from_angles(joint, rest).toRotationMatrix();
    sources.settle_axes(row, parent * turn, std::min({known, of_parent, sources.axes(row).second}));
  }
}

}  // namespace ecorche::rig
