// SPDX-License-Identifier: Apache-2.0
// A pose file: rotations from the scanned rest pose, or absolute anatomical angles.
#include <algorithm>
#include <cmath>

#include <ecorche/io/case_file.hpp>
#include <ecorche/kinematics/angles.hpp>
#include "io/case/pose_file.hpp"
#include "io/case/yaml_reader.hpp"
#include "io/case/yaml_text.hpp"

namespace ecorche::io {
namespace {

using yaml::Value;

Eigen::Quaterniond read_rotation(const Value& value) {
  const auto [w, x, y, z] = value.numbers<4>();
  Eigen::Quaterniond q(w, x, y, z);
  const double norm = q.coeffs().stableNorm();
  if (!(std::abs(norm - 1) <= 1e-3)) {
    value.fail("is a quaternion of length " + yaml::write_number(norm),
               "write a unit quaternion [w, x, y, z]");
  }
  // One that is unit to the last bits stays as it is, so that files read back exactly.
  if (std::abs(norm - 1) > 1e-12) q.coeffs() /= norm;
  return q;
}

Eigen::Vector3d read_vector(const Value& value) {
  const auto [x, y, z] = value.numbers<3>();
  return {x, y, z};
}

void read_joint(const Value& value, const Joint& joint, std::size_t row, Pose& pose) {
  constexpr std::string_view suffix = "_deg";
  std::array<double, 3> angles{0, 0, 0};
  std::vector<std::string> known{"rotation"};
  for (std::size_t i = 0; i < joint.sequence.size() && i < 3; ++i) {
    angles[i] = joint.sequence[i].rest;
    known.push_back(joint.sequence[i].name + std::string(suffix));
  }
  if (joint.kind == JointKind::free && row != 0) known.emplace_back("translation_mm");
  bool turned = false;
  for (const auto& [key, entry] : value.pairs()) {
    const auto found = std::find(known.begin(), known.end(), key);
    if (found == known.end() && key == "translation_mm") {
      entry.fail(
          "'" + joint.name + "' cannot move away from its parent",
          row == 0 ? "write root: {translation_mm: [x, y, z]}" : "only free joints have a translation");
    }
    if (found == known.end()) entry.fail_unknown("key", key, known);
    if (key == "translation_mm") {
      pose.translation[row] = read_vector(entry);
    } else if (key == "rotation") {
      pose.rotation[row] = read_rotation(entry);
    } else {
      angles[static_cast<std::size_t>(found - known.begin()) - 1] = entry.degrees();
      turned = true;
    }
  }
  if (turned && value.find("rotation")) value.fail("gives a rotation and angles", "keep one of them");
  if (turned) pose.rotation[row] = kinematics::rotation_from_angles(joint, angles);
}

}  // namespace

void check_head(const Value& file, std::string_view kind, const Skeleton& skeleton) {
  const Value version = file.at(kind);
  if (version.text() != "1")
    version.fail("version '" + version.text() + "' is not known", "this ecorche reads version 1");
  const Value name = file.at("skeleton");
  if (name.text() != skeleton.name) {
    name.fail("this pose is for the skeleton '" + name.text() + "', the model has '" + skeleton.name + "'",
              "write skeleton: " + skeleton.name + " if the joints are the same");
  }
}

Pose parse_pose(const Value& file, const Rig& rig) {
  constexpr std::array<std::string_view, 2> root_keys{"translation_mm", "rotation"};
  const Skeleton& skeleton = rig.skeleton;
  Pose pose = Pose::rest(skeleton.segments.size());
  bool root_turned = false;
  if (const auto root = file.find("root")) {
    root->allow(root_keys);
    if (const auto translation = root->find("translation_mm"))
      pose.root_translation = read_vector(*translation);
    if (const auto rotation = root->find("rotation")) {
      pose.rotation.at(0) = read_rotation(*rotation);
      root_turned = true;
    }
  }
  const auto joints = file.find("joints");
  if (!joints) return pose;
  for (const auto& [joint, value] : joints->pairs()) {
    const int row = skeleton.find_joint(joint);
    if (row < 0) {
      std::vector<std::string> known;
      for (const Segment& segment : skeleton.segments) known.push_back(segment.joint.name);
      value.fail_unknown("joint", joint, known,
                         "a segment without bones in the case is left out with its joint");
    }
    if (row == 0 && root_turned) value.fail("the root is turned twice", "keep root: {rotation: ...} or this");
    read_joint(value, skeleton.segments[static_cast<std::size_t>(row)].joint, static_cast<std::size_t>(row),
               pose);
  }
  return pose;
}

Pose read_pose(const std::filesystem::path& path, const Rig& rig) {
  constexpr std::array<std::string_view, 4> keys{"ecorche_pose", "skeleton", "root", "joints"};
  const Value file = Value::read(path);
  file.allow(keys);
  check_head(file, "ecorche_pose", rig.skeleton);
  return parse_pose(file, rig);
}

std::string pose_to_yaml(const Pose& pose, const Rig& rig) {
  const auto quaternion = [](const Eigen::Quaterniond& q) {
    return "[" + yaml::write_number(q.w()) + ", " + yaml::write_number(q.x()) + ", " +
           yaml::write_number(q.y()) + ", " + yaml::write_number(q.z()) + "]";
  };
  std::string out = "ecorche_pose: 1\nskeleton: " + yaml::write_text(rig.skeleton.name) + "\n";
  out += "root: {translation_mm: " + yaml::write_vector(pose.root_translation) +
         ", rotation: " + quaternion(pose.rotation.at(0)) + "}\n";
  std::string joints;
  for (std::size_t i = 1; i < rig.skeleton.segments.size(); ++i) {
    const Joint& joint = rig.skeleton.segments[i].joint;
    const bool turned = pose.rotation.at(i).coeffs() != Eigen::Quaterniond::Identity().coeffs();
    const bool moved = joint.kind == JointKind::free && !pose.translation.at(i).isZero(0);
    if (!turned && !moved) continue;
    joints += "  " + yaml::write_text(joint.name) + ": {rotation: " + quaternion(pose.rotation[i]);
    if (moved) joints += ", translation_mm: " + yaml::write_vector(pose.translation[i]);
    joints += "}\n";
  }
  return joints.empty() ? out : out + "joints:\n" + joints;
}

}  // namespace ecorche::io
