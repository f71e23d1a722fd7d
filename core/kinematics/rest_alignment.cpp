// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/rest_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <ecorche/values/error.hpp>
#include "core/kinematics/mean_turn.hpp"
#include "core/linear/decompositions.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kLimb = 0.12;                              // of the skeleton's extent
constexpr double kAlike = 1e-3;                             // radians: no nearer than this counts more
constexpr double kStretched = 45 * std::numbers::pi / 180;  // a limb so far from the scan tells no twist
constexpr double kFacing = 5 * std::numbers::pi / 180;  // hips and shoulders differ so between any two bodies

double extent(const Skeleton& skeleton) {
  Eigen::AlignedBox3d box;
  for (const Segment& segment : skeleton.segments) box.extend(segment.joint.center);
  return box.diagonal().norm();
}

// A limb as scanned and as the clip has it; nothing where the segment is none.
struct Limb {
  bool is = false;
  Vector3d scanned, drawn;
};

Limb limb_of(const Skeleton& skeleton, const std::vector<int>& child, double shortest,
             const ClipPlaces& reference, const std::vector<int>& clip_joint, std::size_t s) {
  if (child[s] < 0) return {};
  const auto c = static_cast<std::size_t>(child[s]);
  if (clip_joint[s] < 0 || clip_joint[c] < 0) return {};
  Limb limb;
  limb.scanned = skeleton.segments[c].joint.center - skeleton.segments[s].joint.center;
  limb.drawn = reference.point[static_cast<std::size_t>(clip_joint[c])] -
               reference.point[static_cast<std::size_t>(clip_joint[s])];
  limb.is = limb.scanned.norm() >= shortest && limb.drawn.norm() > 0;
  return limb;
}

// The turn about a unit axis that brings one direction nearest to another.
Quaterniond about(const Vector3d& axis, const Vector3d& from, const Vector3d& to) {
  const Vector3d a = from - axis * axis.dot(from), b = to - axis * axis.dot(to);
  if (a.norm() < 1e-6 || b.norm() < 1e-6) return Quaterniond::Identity();
  return Quaterniond(Eigen::AngleAxisd(std::atan2(axis.dot(a.cross(b)), a.dot(b)), axis));
}

// The turn about the vertical that brings what stands beside the trunk onto the clip's (Procrustes in the
// plane).
Quaterniond facing(const Skeleton& skeleton, const std::vector<int>& child, const ClipPlaces& reference,
                   const std::vector<int>& clip_joint) {
  double cosine = 0, sine = 0;
  for (std::size_t s = 0; s < skeleton.segments.size(); ++s) {
    if (skeleton.segments[s].parent < 0) continue;
    const auto parent = static_cast<std::size_t>(skeleton.segments[s].parent);
    if (child[parent] >= 0 || clip_joint[s] < 0 || clip_joint[parent] < 0) continue;
    const Vector3d a = skeleton.segments[s].joint.center - skeleton.segments[parent].joint.center;
    const Vector3d b = reference.point[static_cast<std::size_t>(clip_joint[s])] -
                       reference.point[static_cast<std::size_t>(clip_joint[parent])];
    cosine += a.x() * b.x() + a.y() * b.y();
    sine += a.x() * b.y() - a.y() * b.x();
  }
  const double angle = std::atan2(sine, cosine);
  // A zero pose faces somewhere on purpose; what is left of a frame's is where the person looked.
  const bool zero = std::all_of(reference.turn.begin(), reference.turn.end(),
                                [](const Quaterniond& q) { return q.vec().isZero(0); });
  if (zero && std::abs(angle) < kFacing) return Quaterniond::Identity();
  return Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ()));
}

// The turn of a limb whose parent has turned by `above`.
Quaterniond aligned(const Rig& rig, const Limb& limb, const ClipPlaces& reference,
                    const std::vector<int>& clip_joint, const std::vector<int>& child,
                    const std::vector<LimbBend>& bends, std::size_t s, const Quaterniond& above) {
  Quaterniond turn = (linear::turn_between(above * limb.scanned, limb.drawn) * above).normalized();
  if (bends.empty()) return turn;
  // Its own hinge and the one at its end: a shank has the knee alone, a thigh too; the knee tells both.
  const std::size_t hinge = bends[s].known ? s : static_cast<std::size_t>(child[s]);
  const LimbBend own = bends[hinge].known ? bend_of(rig, hinge, bends[hinge].angles) : LimbBend();
  if (!own.known) return turn;
  const auto joint = static_cast<std::size_t>(clip_joint[s]);
  const LimbBend& clip = bends[hinge];
  const Vector3d from = turn * (hinge == s ? own.below : own.above);
  const Vector3d to = reference.turn[joint] * (hinge == s ? clip.below : clip.above);
  return (about(limb.drawn.normalized(), from, to) * turn).normalized();
}

// What each reference counts: 1 for the one whose limbs point most as the scan's do.
std::vector<double> nearness(const Rig& rig, std::span<const ClipPlaces> references,
                             const std::vector<int>& clip_joint) {
  std::vector<double> out;
  for (const ClipPlaces& reference : references) out.push_back(check_limbs(rig, reference, clip_joint).rms);
  const double least = std::max(*std::min_element(out.begin(), out.end()), kAlike);
  for (double& rms : out) rms = least / std::max(rms, kAlike);
  return out;
}

}  // namespace

ClipPlaces places(const Clip& clip, const ClipFrame& frame) {
  if (frame.rotation.size() != clip.joints.size()) {
    throw Error(ErrorKind::internal, "motion " + clip.name,
                "a frame of " + std::to_string(frame.rotation.size()) + " rotations for " +
                    std::to_string(clip.joints.size()) + " joints",
                "read the frame from this clip");
  }
  ClipPlaces out;
  for (std::size_t j = 0; j < clip.joints.size(); ++j) {
    if (clip.joints[j].parent < 0) {
      out.point.push_back(frame.root_position);
      out.turn.push_back(frame.rotation[j]);
      continue;
    }
    const auto parent = static_cast<std::size_t>(clip.joints[j].parent);
    out.point.push_back(out.point[parent] + out.turn[parent] * clip.joints[j].offset);
    out.turn.push_back(out.turn[parent] * frame.rotation[j]);
  }
  return out;
}

ClipPlaces zero_places(const Clip& clip) {
  ClipFrame zero;
  if (!clip.joints.empty()) zero.root_position = clip.joints[0].offset;
  zero.rotation.assign(clip.joints.size(), Quaterniond::Identity());
  return places(clip, zero);
}

RestAlignment align_rest(const Rig& rig, std::span<const ClipPlaces> references,
                         const std::vector<int>& clip_joint, const std::vector<LimbBend>& bends) {
  if (references.empty()) throw Error(ErrorKind::internal, "alignment", "no reference", "name one or more");
  const auto& segments = rig.skeleton.segments;
  const double shortest = kLimb * extent(rig.skeleton);
  const std::vector<int> child = only_child(rig.skeleton);
  const std::vector<double> weights = nearness(rig, references, clip_joint);
  std::vector<std::vector<Quaterniond>> turn(references.size(), std::vector<Quaterniond>(segments.size()));
  RestAlignment out;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    MeanTurn mean;
    for (std::size_t r = 0; r < references.size(); ++r) {
      const Quaterniond above = segments[s].parent < 0
                                    ? facing(rig.skeleton, child, references[r], clip_joint)
                                    : turn[r][static_cast<std::size_t>(segments[s].parent)];
      const Limb limb = limb_of(rig.skeleton, child, shortest, references[r], clip_joint, s);
      turn[r][s] = limb.is ? aligned(rig, limb, references[r], clip_joint, child, bends, s, above) : above;
      if (clip_joint[s] < 0) continue;
      const auto& joint = references[r].turn[static_cast<std::size_t>(clip_joint[s])];
      mean.add(joint.conjugate() * turn[r][s], weights[r]);
    }
    out.alignment.push_back(mean.mean());
    if (references.size() == 1 || clip_joint[s] < 0) continue;
    for (std::size_t r = 0; r < references.size(); ++r) {
      const auto& joint = references[r].turn[static_cast<std::size_t>(clip_joint[s])];
      turn[r][s] = (joint * out.alignment[s]).normalized();
    }
  }
  out.rest_turn = turn[0];
  return out;
}

void hang_ends(const Rig& rig, const ClipPlaces& zero, const std::vector<int>& clip_joint,
               const RestAlignment& over_clip, RestAlignment& at_zero) {
  const auto& segments = rig.skeleton.segments;
  const double shortest = kLimb * extent(rig.skeleton);
  const std::vector<int> child = only_child(rig.skeleton);
  const Quaterniond upright = facing(rig.skeleton, child, zero, clip_joint);
  std::vector<bool> away(segments.size(), false), limb(segments.size(), false), moved(segments.size(), false);
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const Limb here = limb_of(rig.skeleton, child, shortest, zero, clip_joint, s);
    limb[s] = here.is;
    if (here.is)
      away[s] =
          linear::turn_between(upright * here.scanned, here.drawn).angularDistance(Quaterniond::Identity()) >
          kStretched;
    if (here.is || segments[s].parent < 0) continue;
    const auto p = static_cast<std::size_t>(segments[s].parent);
    moved[s] = moved[p] || (limb[p] && away[p] && clip_joint[s] >= 0 && clip_joint[p] >= 0);
    if (!moved[s]) continue;
    const Quaterniond before = at_zero.alignment[s];
    if (clip_joint[s] < 0) {
      at_zero.rest_turn[s] = at_zero.rest_turn[p];
      continue;
    }
    at_zero.alignment[s] =
        (over_clip.alignment[s] * over_clip.alignment[p].conjugate() * at_zero.alignment[p]).normalized();
    at_zero.rest_turn[s] = (at_zero.rest_turn[s] * before.conjugate() * at_zero.alignment[s]).normalized();
  }
}

LimbCheck check_limbs(const Rig& rig, const ClipPlaces& reference, const std::vector<int>& clip_joint) {
  const double shortest = kLimb * extent(rig.skeleton);
  const std::vector<int> child = only_child(rig.skeleton);
  const Quaterniond turn = facing(rig.skeleton, child, reference, clip_joint);
  LimbCheck out;
  double scanned = 0, drawn = 0;
  for (std::size_t s = 0; s < rig.skeleton.segments.size(); ++s) {
    const Limb limb = limb_of(rig.skeleton, child, shortest, reference, clip_joint, s);
    if (!limb.is) continue;
    const Vector3d a = turn * limb.scanned;
    const double angle = std::atan2(a.cross(limb.drawn).norm(), a.dot(limb.drawn));
    out.rms += angle * angle;
    out.worst = std::max(out.worst, angle);
    scanned += limb.scanned.norm();
    drawn += limb.drawn.norm();
    ++out.limbs;
  }
  if (out.limbs == 0) return out;
  out.rms = std::sqrt(out.rms / out.limbs);
  out.figure = drawn / scanned;
  return out;
}

}  // namespace ecorche::kinematics
