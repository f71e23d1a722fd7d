// SPDX-License-Identifier: Apache-2.0
// A motion clip played on a rig, joint by joint name.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include "core/kinematics/rest_alignment.hpp"

namespace ecorche::kinematics {

/// Which clip joint moves which segment. Names are compared without case, spaces, '_' and ':' prefixes; a
/// segment's own name, its joint's name and its aliases count, then what other skeletons call them
/// (joint_names.hpp).
struct Retarget {
  std::vector<int> clip_joint;  ///< #segments; -1 where the clip has none: follows its parent
  /// #segments: with G the global turn of the clip's joint, G * alignment is the segment's from the scan.
  std::vector<Eigen::Quaterniond> alignment;
  std::vector<Eigen::Quaterniond> rest_turn;  ///< #segments, from the scan to the reference (align_rest)
  /// Where the clip's joint of the root is when the patient stands where it was scanned, mm LPS.
  Eigen::Vector3d home = Eigen::Vector3d::Zero();
  double scale = 1;             ///< of the root's way; 1 / limbs.figure fits it to the patient's size
  LimbCheck limbs;              ///< at the reference
  std::vector<LimbBend> bends;  ///< of the clip; empty until they are looked for (find_bends)
  std::vector<std::string> unused_joints;   ///< clip joints that move nothing (end sites excepted)
  std::vector<std::string> still_segments;  ///< segments that no clip joint moves
};

/// Clip joints by the segments they move, as the user says; a clip joint that moves nothing on purpose has
/// "".
using NameMap = std::map<std::string, std::string>;

/// Matches names, and aligns at the clip's zero pose; `home` is the root's zero offset, lifted where that
/// pose reaches below the floor (z = 0) until its legs, straight, stand on it. Throws Error{data} when
/// nothing matches, naming both sides' joints, and Error{config} for names of the map that neither side has.
Retarget match(const Rig& rig, const Clip& clip, const NameMap& names = {});

/// Looks through frames of the clip (64 or so do, over its length) for the planes in which its limbs bend,
/// and how hands stand on the arms (hang_ends), and aligns at the zero pose with them; align_at uses the
/// planes.
void find_bends(const Rig& rig, const Clip& clip, std::span<const ClipFrame> frames, Retarget& retarget);

/// `match` at frames of a clip with the same joints in which the person stands as the patient was scanned
/// but for its limbs' directions (align_rest): for rigs whose zero pose is no pose of a body. `home` and
/// `limbs` are of the first. Throws Error{internal} for no frames.
void align_at(const Rig& rig, const Clip& clip, std::span<const ClipFrame> references, Retarget& retarget);

/// The pose of `rig` at a frame: global turns of the clip's joints become turns of the segments, so that clip
/// joints without a segment are folded into their descendants; the root's translation is its way from home.
/// Not clamped: see angles.hpp. Throws Error{internal} for a frame that is not this clip's.
Pose pose_at(const Rig& rig, const Clip& clip, const Retarget& retarget, const ClipFrame& frame);
Pose pose_at(const Rig& rig, const Clip& clip, const Retarget& retarget, std::size_t frame);

}  // namespace ecorche::kinematics
