// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/motion_report.hpp"

#include <algorithm>
#include <cmath>

#include "core/kinematics/angles.hpp"
#include "core/kinematics/forward.hpp"
#include "core/kinematics/joint_names.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kContact = 25;  // mm
constexpr double kFloorShare = 0.05;

constexpr double kBeyond = 0.5 / 57.29577951308232;  // radians: half a degree less is printed as none

// What the limits of a joint took away. A hinge also drops all turns that it cannot make, which are no
// limit's: of those the one about its own axis counts alone.
double taken(const Joint& joint, const Quaterniond& asked, const Quaterniond& now, double removed) {
  const bool follows = std::any_of(joint.coupled.begin(), joint.coupled.end(),
                                   [](const Coupling& by) { return by.slides() < 0; });
  if (joint.kind != JointKind::hinge || joint.sequence.empty() || follows) return removed;
  const Vector3d axis = Vector3d::Unit(joint.sequence[0].axis);
  const Vector3d along = axis * asked.vec().dot(axis);
  const Quaterniond about(asked.w(), along.x(), along.y(), along.z());
  return about.norm() > 0 ? about.normalized().angularDistance(now) : removed;
}

std::vector<std::size_t> feet(const Skeleton& skeleton) {
  std::vector<std::size_t> out;
  for (std::size_t s = 0; s < skeleton.segments.size(); ++s) {
    std::vector<std::string> names = skeleton.segments[s].aliases;
    names.insert(names.begin(), {skeleton.segments[s].name, skeleton.segments[s].joint.name});
    std::vector<std::string> all = synonyms(names);
    for (const std::string& name : names) all.push_back(plain_name(name));
    const bool foot = std::any_of(all.begin(), all.end(), [](const std::string& name) {
      return name == "leftfoot" || name == "rightfoot" || name == "lefttoebase" || name == "righttoebase";
    });
    if (foot) out.push_back(s);
  }
  return out;
}

}  // namespace

MotionReport report(const Rig& rig, std::size_t frames, double frame_seconds,
                    const std::function<Pose(std::size_t)>& pose) {
  const std::size_t joints = rig.skeleton.segments.size();
  const std::vector<std::size_t> foot = feet(rig.skeleton);
  std::vector<RigidTransform> motion(joints);
  std::vector<ClampedJoint> clamped;
  MotionReport out;
  std::vector<LimitViolation> limits(joints);
  std::vector<std::vector<float>> heights(foot.size());
  const auto place = [&](std::size_t f) -> Vector3d {
    return motion[foot[f]] * rig.skeleton.segments[foot[f]].joint.center;
  };
  for (std::size_t frame = 0; frame < frames; ++frame) {
    Pose now = pose(frame);
    const Pose asked = now;
    clamped.clear();
    constrain(rig.skeleton, now, clamped);
    for (const ClampedJoint& c : clamped) {
      const auto j = static_cast<std::size_t>(c.joint);
      LimitViolation& limit = limits[j];
      const double removed =
          taken(rig.skeleton.segments[j].joint, asked.rotation[j], now.rotation[j], c.removed);
      if (removed < kBeyond) continue;
      ++limit.share;
      limit.mean += removed;
      if (removed > limit.worst) limit.worst_frame = frame;
      limit.worst = std::max(limit.worst, removed);
    }
    forward(rig, now, motion);
    for (std::size_t f = 0; f < foot.size(); ++f) heights[f].push_back(static_cast<float>(place(f).z()));
  }
  std::vector<double> floor(foot.size(), 0);
  for (std::size_t f = 0; f < foot.size() && frames > 0; ++f) {
    const auto low =
        heights[f].begin() + static_cast<std::ptrdiff_t>(kFloorShare * static_cast<double>(frames));
    std::nth_element(heights[f].begin(), low, heights[f].end());
    floor[f] = static_cast<double>(*low);
  }
  for (std::size_t j = 0; j < joints; ++j) {
    if (limits[j].share == 0) continue;
    limits[j].joint = rig.skeleton.segments[j].joint.name;
    limits[j].mean /= limits[j].share;
    limits[j].share /= static_cast<double>(frames);
    out.limits.push_back(limits[j]);
  }
  std::stable_sort(out.limits.begin(), out.limits.end(),
                   [](const LimitViolation& a, const LimitViolation& b) { return a.worst > b.worst; });

  for (const std::size_t s : foot) out.feet.push_back({rig.skeleton.segments[s].joint.name, 0, 0, 0});
  std::vector<Vector3d> before(foot.size());
  for (std::size_t frame = 0; frame < frames; ++frame) {
    Pose now = pose(frame);
    clamped.clear();
    constrain(rig.skeleton, now, clamped);
    forward(rig, now, motion);
    for (std::size_t f = 0; f < foot.size(); ++f) {
      const Vector3d at = place(f);
      const double height = std::max(at.z() - floor[f], 0.0);
      if (height < kContact) {
        ++out.feet[f].contact_share;
        if (frame > 0) {
          const double step = (at - before[f]).head<2>().norm() * (2 - std::exp2(height / kContact));
          out.feet[f].mean_mm_per_s += step / frame_seconds;
          out.feet[f].worst_mm_per_s = std::max(out.feet[f].worst_mm_per_s, step / frame_seconds);
        }
      }
      before[f] = at;
    }
  }
  for (FootSliding& f : out.feet) {
    if (f.contact_share > 0) f.mean_mm_per_s /= f.contact_share;
    f.contact_share /= static_cast<double>(frames);
  }
  return out;
}

}  // namespace ecorche::kinematics
