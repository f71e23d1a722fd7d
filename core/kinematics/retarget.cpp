// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/retarget.hpp"

#include <algorithm>
#include <cctype>

#include "core/kinematics/rest_alignment.hpp"
#include "core/values/error.hpp"

namespace ecorche::kinematics {
namespace {

// `mixamorig:Left_Up Leg` -> `leftupleg`
std::string plain(std::string_view name) {
  const std::size_t colon = name.rfind(':');
  if (colon != std::string_view::npos) name.remove_prefix(colon + 1);
  std::string out;
  for (const char c : name) {
    if (c != ' ' && c != '_') out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return out;
}

bool is_end_site(const Clip& clip, std::size_t joint) {
  for (const ClipJoint& other : clip.joints) {
    if (other.parent == static_cast<int>(joint)) return false;
  }
  const std::string name = plain(clip.joints[joint].name);
  return name.find("endsite") != std::string::npos || name.ends_with("end") || name.ends_with("nub");
}

std::string list_of(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
  return out.empty() ? "nothing" : out;
}

// Gives each still unmatched segment the clip joint that has one of its names of one sort.
template <class NamesOf>
void match_by(const Rig& rig, const Clip& clip, NamesOf names_of, std::vector<int>& clip_joint,
              std::vector<bool>& taken) {
  for (std::size_t s = 0; s < clip_joint.size(); ++s) {
    for (const std::string& name : names_of(rig.skeleton.segments[s])) {
      for (std::size_t j = 0; j < clip.joints.size() && clip_joint[s] < 0; ++j) {
        if (taken[j] || plain(clip.joints[j].name) != plain(name)) continue;
        clip_joint[s] = static_cast<int>(j);
        taken[j] = true;
      }
    }
  }
}

// Turn and place of a clip joint. The chain to the root is short, so nothing is kept.
struct ClipPlace {
  Eigen::Quaterniond turn;
  Eigen::Vector3d point;
};

ClipPlace place_of(const Clip& clip, std::size_t frame, int joint) {
  const auto j = static_cast<std::size_t>(joint);
  const Eigen::Quaterniond& local = clip.rotation[frame * clip.joints.size() + j];
  if (clip.joints[j].parent < 0) return {local, clip.root_position[frame]};
  const ClipPlace parent = place_of(clip, frame, clip.joints[j].parent);
  return {parent.turn * local, parent.point + parent.turn * clip.joints[j].offset};
}

}  // namespace

Retarget match(const Rig& rig, const Clip& clip) {
  using Names = std::vector<std::string>;
  Retarget out;
  out.clip_joint.assign(rig.skeleton.segments.size(), -1);
  std::vector<bool> taken(clip.joints.size(), false);
  // Sort by sort, so that no joint's name takes away what is another segment's own.
  match_by(
      rig, clip, [](const Segment& s) { return Names{s.name}; }, out.clip_joint, taken);
  match_by(
      rig, clip, [](const Segment& s) { return Names{s.joint.name}; }, out.clip_joint, taken);
  match_by(
      rig, clip, [](const Segment& s) { return s.aliases; }, out.clip_joint, taken);

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
                "add the clip's joint names to the skeleton as aliases");
  }
  out.alignment = align_rest(rig, clip, out.clip_joint);
  return out;
}

Pose pose_at(const Rig& rig, const Clip& clip, const Retarget& retarget, std::size_t frame) {
  const auto& segments = rig.skeleton.segments;
  if (retarget.clip_joint.size() != segments.size() || frame >= clip.frames() ||
      clip.rotation.size() != clip.frames() * clip.joints.size()) {
    throw Error(ErrorKind::internal, "motion " + clip.name,
                "frame " + std::to_string(frame) + " of " + std::to_string(clip.frames()) + " for " +
                    std::to_string(retarget.clip_joint.size()) + " of " + std::to_string(segments.size()) +
                    " segments",
                "ask for a frame of the clip, with the match of this rig");
  }
  Pose pose = Pose::rest(segments.size());
  std::vector<Eigen::Quaterniond> turn(segments.size());  // global, from rest, LPS
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const int parent = segments[s].parent;
    const Eigen::Quaterniond parent_turn =
        parent < 0 ? Eigen::Quaterniond::Identity() : turn[static_cast<std::size_t>(parent)];
    const int joint = retarget.clip_joint[s];
    turn[s] = joint < 0 ? parent_turn : place_of(clip, frame, joint).turn * retarget.alignment[s];
    const Eigen::Quaterniond local = parent_turn.conjugate() * turn[s];
    const Eigen::Vector3d v = segments[s].joint.axes.transpose() * local.vec();
    pose.rotation[s] = Eigen::Quaterniond(local.w(), v.x(), v.y(), v.z()).normalized();
  }
  const int root = std::max(retarget.clip_joint[0], 0);
  pose.root_translation = place_of(clip, frame, root).point - zero_point(clip, root);
  return pose;
}

}  // namespace ecorche::kinematics
