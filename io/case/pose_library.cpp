// SPDX-License-Identifier: Apache-2.0
#include <ecorche/io/pose_library.hpp>

#include <algorithm>

#include <ecorche/kinematics/named_angles.hpp>
#include <ecorche/values/error.hpp>
#include "io/case/embedded.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {
namespace {

using yaml::Value;

constexpr std::string_view kDegrees = "_deg";

Value library() {
  return Value::parse(embedded::poses, "pose library");
}

}  // namespace

std::vector<std::string> library_poses() {
  std::vector<std::string> out;
  for (const auto& [name, pose] : library().pairs()) out.push_back(name);
  std::sort(out.begin(), out.end());
  return out;
}

LibraryPose library_pose(std::string_view name, const Rig& rig) {
  const auto entry = library().find(name);
  if (!entry) {
    std::string known;
    for (const std::string& other : library_poses()) known += (known.empty() ? "" : ", ") + other;
    throw Error(ErrorKind::usage, "pose library", "has no pose '" + std::string(name) + "'",
                "it has " + known);
  }
  std::vector<kinematics::AngleValue> values;
  LibraryPose out;
  const auto turn = [&](const std::string& joint, const Value& angles) {
    for (const auto& [key, value] : angles.pairs()) {
      const std::string angle = key.substr(0, key.size() - kDegrees.size());
      const auto found = kinematics::find_named_angle(rig.skeleton, joint, angle);
      if (found) {
        values.push_back({*found, value.degrees()});
      } else {
        out.left_out.push_back(std::string(joint).append(".").append(angle));
      }
    }
  };
  for (const auto& [joint, angles] : entry->at("joints").pairs()) {
    for (const std::string side : {"_left", "_right"}) turn(joint + side, angles);
  }
  if (const auto middle = entry->find("middle")) {
    for (const auto& [joint, angles] : middle->pairs()) turn(joint, angles);
  }
  if (values.empty()) {
    throw Error(ErrorKind::config, "skeleton " + rig.skeleton.name,
                "has none of the joints of the pose '" + std::string(name) + "'",
                "name its joints hip_left, knee_left, ... or write a pose file");
  }
  out.pose = kinematics::pose_of(rig.skeleton, values);
  if (const auto root = entry->find("root")) {
    const auto [w, x, y, z] = root->at("rotation").numbers<4>();
    // Given in the room: into the root joint's own frame.
    const Eigen::Vector3d v = rig.skeleton.segments.at(0).joint.axes.transpose() * Eigen::Vector3d(x, y, z);
    out.pose.rotation.at(0) = Eigen::Quaterniond(w, v.x(), v.y(), v.z());
  }
  return out;
}

}  // namespace ecorche::io
