// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/retarget.hpp"

#include <algorithm>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/values/error.hpp>
#include "core/kinematics/joint_names.hpp"
#include "core/values/text.hpp"

namespace ecorche::kinematics {
namespace {

constexpr double kLongBone = 0.12;  // of the figure's extent

bool is_end_site(const Clip& clip, std::size_t joint) {
  for (const ClipJoint& other : clip.joints) {
    if (other.parent == static_cast<int>(joint)) return false;
  }
  const std::string name = plain_name(clip.joints[joint].name);
  return name.find("endsite") != std::string::npos || name.ends_with("end") || name.ends_with("nub");
}

std::string list_of(const std::vector<std::string>& names) {
  return names.empty() ? "nothing" : text::joined(names);
}

// Gives each still unmatched segment the clip joint that has one of its names of one sort.
template <class NamesOf>
void match_by(const Rig& rig, const Clip& clip, NamesOf names_of, std::vector<int>& clip_joint,
              std::vector<bool>& taken) {
  std::vector<std::string> joints;
  for (const ClipJoint& joint : clip.joints) joints.push_back(joint.name);
  joints = plain_names(joints);
  for (std::size_t s = 0; s < clip_joint.size(); ++s) {
    for (const std::string& name : names_of(rig.skeleton.segments[s])) {
      for (std::size_t j = 0; j < clip.joints.size() && clip_joint[s] < 0; ++j) {
        if (taken[j] || joints[j] != plain_name(name)) continue;
        clip_joint[s] = static_cast<int>(j);
        taken[j] = true;
      }
    }
  }
}

// What the user says goes before any name.
void match_by_map(const Rig& rig, const Clip& clip, const NameMap& names, std::vector<int>& clip_joint,
                  std::vector<bool>& taken) {
  for (const auto& [joint, segment] : names) {
    std::size_t j = 0;
    while (j < clip.joints.size() && clip.joints[j].name != joint) ++j;
    if (j == clip.joints.size())
      throw Error(ErrorKind::config, "motion map", "the clip has no joint '" + joint + "'",
                  "write the name as the clip has it");
    taken[j] = true;
    if (segment.empty()) continue;
    const int row = rig.skeleton.find_segment(segment);
    if (row < 0)
      throw Error(ErrorKind::config, "motion map", "the skeleton has no segment '" + segment + "'",
                  "see ecorche info MODEL");
    if (clip_joint[static_cast<std::size_t>(row)] >= 0)
      throw Error(ErrorKind::config, "motion map", "two joints move the segment '" + segment + "'",
                  "keep one of them");
    clip_joint[static_cast<std::size_t>(row)] = static_cast<int>(j);
  }
}

std::size_t root_joint(const Retarget& retarget) {
  return static_cast<std::size_t>(std::max(retarget.clip_joint[0], 0));
}

// How high the root of the zero pose stands on straight legs: long bones count in full, the rest by their
// height.
Eigen::Vector3d standing_home(const Clip& clip, std::size_t root, double long_bone) {
  const ClipPlaces zero = zero_places(clip);
  std::size_t lowest = root;
  for (std::size_t j = 0; j < zero.point.size(); ++j) {
    if (zero.point[j].z() < zero.point[lowest].z()) lowest = j;
  }
  Eigen::Vector3d home = zero.point[root];
  if (zero.point[lowest].z() >= -1e-3 * long_bone) return home;
  double height = 0;
  for (int j = static_cast<int>(lowest); j >= 0 && j != static_cast<int>(root);
       j = clip.joints[static_cast<std::size_t>(j)].parent) {
    const Eigen::Vector3d& offset = clip.joints[static_cast<std::size_t>(j)].offset;
    height += offset.norm() >= long_bone ? offset.norm() : -offset.z();
  }
  home.z() = std::max(height, 0.0);
  return home;
}

void take(RestAlignment&& from, Retarget& retarget) {
  retarget.alignment = std::move(from.alignment);
  retarget.rest_turn = std::move(from.rest_turn);
}

double extent(const ClipPlaces& at) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : at.point) box.extend(point);
  return box.diagonal().norm();
}

// Whether it follows joints that all come before it: a clip that has none for it still moves it.
bool led_from_above(const Skeleton& skeleton, std::size_t row) {
  const Joint& joint = skeleton.segments[row].joint;
  return drives_angles(joint) &&
         std::all_of(joint.coupled.begin(), joint.coupled.end(), [&](const Coupling& c) {
           return c.slides() >= 0 || skeleton.find_joint(c.joint) < static_cast<int>(row);
         });
}

}  // namespace

Retarget match(const Rig& rig, const Clip& clip, const NameMap& names) {
  using Names = std::vector<std::string>;
  Retarget out;
  out.clip_joint.assign(rig.skeleton.segments.size(), -1);
  std::vector<bool> taken(clip.joints.size(), false);
  match_by_map(rig, clip, names, out.clip_joint, taken);
  // Sort by sort, so that no joint's name takes away what is another segment's own.
  match_by(
      rig, clip, [](const Segment& s) { return Names{s.name}; }, out.clip_joint, taken);
  match_by(
      rig, clip, [](const Segment& s) { return Names{s.joint.name}; }, out.clip_joint, taken);
  match_by(
      rig, clip, [](const Segment& s) { return s.aliases; }, out.clip_joint, taken);
  const auto foreign = [](const Segment& s) {
    Names own = s.aliases;
    own.insert(own.begin(), {s.name, s.joint.name});
    return synonyms(own);
  };
  match_by(rig, clip, foreign, out.clip_joint, taken);

  Names segments;
  for (std::size_t s = 0; s < out.clip_joint.size(); ++s) {
    segments.push_back(rig.skeleton.segments[s].name);
    if (out.clip_joint[s] < 0) out.still_segments.push_back(segments.back());
  }
  Names joints;
  for (std::size_t j = 0; j < clip.joints.size(); ++j) {
    joints.push_back(clip.joints[j].name);
    if (!taken[j] && !is_end_site(clip, j)) out.unused_joints.push_back(joints.back());
  }
  if (out.still_segments.size() == segments.size()) {
    throw Error(ErrorKind::data, "motion " + clip.name,
                "no joint of the clip (" + list_of(joints) + ") has the name of a segment (" +
                    list_of(segments) + ")",
                "say by --map FILE which joint moves which segment");
  }
  const ClipPlaces zero = zero_places(clip);
  take(align_rest(rig, std::span(&zero, 1), out.clip_joint), out);
  out.limbs = check_limbs(rig, zero, out.clip_joint);
  out.home = standing_home(clip, root_joint(out), kLongBone * extent(zero));
  return out;
}

void find_bends(const Rig& rig, const Clip& clip, std::span<const ClipFrame> frames, Retarget& retarget) {
  BendFinder finder(rig, retarget.clip_joint);
  std::vector<ClipPlaces> at;
  for (const ClipFrame& frame : frames) {
    at.push_back(places(clip, frame));
    finder.add(at.back());
  }
  retarget.bends = finder.bends();
  const ClipPlaces zero = zero_places(clip);
  RestAlignment aligned = align_rest(rig, std::span(&zero, 1), retarget.clip_joint, retarget.bends);
  if (!at.empty())
    hang_ends(rig, zero, retarget.clip_joint, align_rest(rig, at, retarget.clip_joint, retarget.bends),
              aligned);
  take(std::move(aligned), retarget);
}

void align_at(const Rig& rig, const Clip& clip, std::span<const ClipFrame> references, Retarget& retarget) {
  std::vector<ClipPlaces> at;
  for (const ClipFrame& reference : references) at.push_back(places(clip, reference));
  take(align_rest(rig, at, retarget.clip_joint, retarget.bends), retarget);
  retarget.limbs = check_limbs(rig, at[0], retarget.clip_joint);
  retarget.home = at[0].point[root_joint(retarget)];
}

Pose pose_at(const Rig& rig, const Clip& clip, const Retarget& retarget, const ClipFrame& frame) {
  const auto& segments = rig.skeleton.segments;
  if (retarget.clip_joint.size() != segments.size()) {
    throw Error(ErrorKind::internal, "motion " + clip.name,
                "a match of " + std::to_string(retarget.clip_joint.size()) + " segments for " +
                    std::to_string(segments.size()),
                "match the clip with this rig");
  }
  const ClipPlaces at = places(clip, frame);
  Pose pose = Pose::rest(segments.size());
  std::vector<Eigen::Quaterniond> turn(segments.size());  // global, from rest, LPS
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const int parent = segments[s].parent;
    const Eigen::Quaterniond parent_turn =
        parent < 0 ? Eigen::Quaterniond::Identity() : turn[static_cast<std::size_t>(parent)];
    const int joint = retarget.clip_joint[s];
    if (joint < 0 && led_from_above(rig.skeleton, s)) {  // what hangs on it turns from where it will be
      pose.rotation[s] = follow(rig.skeleton, pose, s);
      const Eigen::Quaterniond axes(segments[s].joint.axes);
      turn[s] = (parent_turn * axes * pose.rotation[s] * axes.conjugate()).normalized();
      continue;
    }
    turn[s] = joint < 0 ? parent_turn : at.turn[static_cast<std::size_t>(joint)] * retarget.alignment[s];
    const Eigen::Quaterniond local = parent_turn.conjugate() * turn[s];
    const Eigen::Vector3d v = segments[s].joint.axes.transpose() * local.vec();
    pose.rotation[s] = Eigen::Quaterniond(local.w(), v.x(), v.y(), v.z()).normalized();
  }
  pose.root_translation = retarget.scale * (at.point[root_joint(retarget)] - retarget.home);
  return pose;
}

Pose pose_at(const Rig& rig, const Clip& clip, const Retarget& retarget, std::size_t frame) {
  const std::size_t joints = clip.joints.size();
  if (frame >= clip.frames() || clip.rotation.size() != clip.frames() * joints) {
    throw Error(ErrorKind::internal, "motion " + clip.name,
                "frame " + std::to_string(frame) + " of " + std::to_string(clip.frames()),
                "ask for a frame of the clip");
  }
  const auto begin = clip.rotation.begin() + static_cast<std::ptrdiff_t>(frame * joints);
  return pose_at(rig, clip, retarget,
                 ClipFrame{clip.root_position[frame], {begin, begin + static_cast<std::ptrdiff_t>(joints)}});
}

}  // namespace ecorche::kinematics
