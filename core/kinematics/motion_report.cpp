// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/motion_report.hpp"

#include <algorithm>
#include <cmath>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "core/kinematics/joint_names.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kContact = 25;  // mm
constexpr double kFloorShare = 0.05;
constexpr double kSlowest = 50;   // mm/s: slower than anybody walks
constexpr double kInPlace = 0.2;  // of the ground's speed, what the body may travel meanwhile

constexpr double kBeyond = 0.5 / 57.29577951308232;  // radians: half a degree less is printed as none

// What the limits of a joint took away. A hinge also drops all turns that it cannot make, which are no
// limit's: of those the one about its own axis counts alone.
double removed_by_limits(const Joint& joint, const Quaterniond& asked, const Quaterniond& now,
                         double removed) {
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

// One foot in every frame: in floats, since a long clip is not to need memory.
struct Track {
  std::vector<float> height;              // mm; over the floor once all are known
  std::vector<Eigen::Vector2f> velocity;  // from the frame before, mm/s; of the first, 0
  Vector3d last = Vector3d::Zero();

  explicit Track(std::size_t frames) {
    height.reserve(frames);
    velocity.reserve(frames);
  }
  void add(const Vector3d& at, double frame_seconds) {
    const Vector2d step = height.empty() ? Vector2d(0, 0) : Vector2d((at - last).head<2>() / frame_seconds);
    height.push_back(static_cast<float>(at.z()));
    velocity.push_back(step.cast<float>());
    last = at;
  }
  void stand_on_floor() {
    std::vector<float> sorted = height;
    const auto low =
        sorted.begin() + static_cast<std::ptrdiff_t>(kFloorShare * static_cast<double>(sorted.size()));
    std::nth_element(sorted.begin(), low, sorted.end());
    for (float& h : height) h = std::max(h - *low, 0.0F);
  }
  // 0: not in contact.
  double weight(std::size_t frame) const {
    const double h = static_cast<double>(height[frame]);
    return h < kContact ? 2 - std::exp2(h / kContact) : 0;
  }
};

// Feet that go one way while they stand, of a body that does not get there, walk on a ground that moves.
Vector2d ground_of(const std::vector<Track>& feet, const Vector2d& travel) {
  Vector2d sum = Vector2d::Zero();
  double weight = 0;
  for (const Track& foot : feet) {
    for (std::size_t frame = 1; frame < foot.height.size(); ++frame) {
      if (foot.weight(frame - 1) == 0) continue;  // comes down from the air
      sum += foot.weight(frame) * foot.velocity[frame].cast<double>();
      weight += foot.weight(frame);
    }
  }
  const Vector2d mean = weight > 0 ? Vector2d(sum / weight) : Vector2d::Zero();
  return mean.norm() > kSlowest && travel.norm() < kInPlace * mean.norm() ? mean : Vector2d::Zero();
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
  std::vector<Track> tracks;
  for (std::size_t f = 0; f < foot.size(); ++f) tracks.emplace_back(frames);
  Vector3d begin = Vector3d::Zero(), end = begin;  // of the root
  for (std::size_t frame = 0; frame < frames; ++frame) {
    Pose now = pose(frame);
    const Pose asked = now;
    clamped.clear();
    constrain(rig.skeleton, now, clamped);
    for (const ClampedJoint& c : clamped) {
      const auto j = static_cast<std::size_t>(c.joint);
      LimitViolation& limit = limits[j];
      const double removed =
          removed_by_limits(rig.skeleton.segments[j].joint, asked.rotation[j], now.rotation[j], c.removed);
      if (removed < kBeyond) continue;
      ++limit.share;
      limit.mean += removed;
      if (removed > limit.worst) limit.worst_frame = frame;
      limit.worst = std::max(limit.worst, removed);
    }
    forward(rig, now, motion);
    for (std::size_t f = 0; f < foot.size(); ++f)
      tracks[f].add(motion[foot[f]] * rig.skeleton.segments[foot[f]].joint.center, frame_seconds);
    end = motion[0] * rig.skeleton.segments[0].joint.center;
    if (frame == 0) begin = end;
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
  if (frames == 0) return out;
  for (Track& track : tracks) track.stand_on_floor();
  const Vector2d travel =
      (end - begin).head<2>() / (frame_seconds * static_cast<double>(std::max<std::size_t>(frames - 1, 1)));
  out.ground = ground_of(tracks, travel);
  for (std::size_t f = 0; f < foot.size(); ++f) {
    FootSliding& sliding = out.feet[f];
    for (std::size_t frame = 0; frame < frames; ++frame) {
      const double weight = tracks[f].weight(frame);
      if (weight == 0) continue;
      ++sliding.contact_share;
      if (frame == 0) continue;  // nobody knows what led to it
      const double speed = (tracks[f].velocity[frame].cast<double>() - out.ground).norm() * weight;
      sliding.mean_mm_per_s += speed;
      sliding.worst_mm_per_s = std::max(sliding.worst_mm_per_s, speed);
    }
    if (sliding.contact_share > 0) sliding.mean_mm_per_s /= sliding.contact_share;
    sliding.contact_share /= static_cast<double>(frames);
  }
  return out;
}

}  // namespace ecorche::kinematics
