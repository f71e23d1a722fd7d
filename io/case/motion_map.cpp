// SPDX-License-Identifier: Apache-2.0
#include "io/case/motion_map.hpp"

#include <array>
#include <cmath>

#include "io/case/embedded.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {
namespace {

using yaml::Value;

std::vector<std::string> joint_names(const Skeleton& skeleton) {
  std::vector<std::string> out;
  for (const Segment& segment : skeleton.segments) out.push_back(segment.joint.name);
  return out;
}

std::vector<std::string> segment_names(const Skeleton& skeleton) {
  std::vector<std::string> out;
  for (const Segment& segment : skeleton.segments) out.push_back(segment.name);
  return out;
}

// `strict`: a joint or angle that the skeleton lacks is refused, else passed over.
std::vector<AngleShare> read_shares(const Value& list, const Rig& rig, bool strict) {
  constexpr std::array<std::string_view, 3> keys{"joint", "angle", "scale"};
  std::vector<AngleShare> out;
  for (const Value& item : list.items()) {
    item.allow(keys);
    const Value joint = item.at("joint"), angle = item.at("angle");
    const auto found = kinematics::find_named_angle(rig.skeleton, joint.text(), angle.text());
    if (!found && strict) {
      const int row = rig.skeleton.find_joint(joint.text());
      if (row < 0) joint.fail_unknown("joint", joint.text(), joint_names(rig.skeleton));
      std::vector<std::string> known;
      for (const AngleAxis& a : rig.skeleton.segments[static_cast<std::size_t>(row)].joint.sequence)
        known.push_back(a.name);
      angle.fail_unknown("angle", angle.text(), known);
    }
    if (!found) continue;
    AngleShare share{*found, 1};
    if (const auto scale = item.find("scale")) share.scale = scale->number();
    if (!(std::abs(share.scale) <= 1000)) item.at("scale").fail("is too large", "write a factor such as -1");
    out.push_back(share);
  }
  return out;
}

MarkerPlace read_marker(const Value& value, const Rig& rig) {
  const auto& segments = rig.skeleton.segments;
  if (value.kind() == yaml::Kind::scalar) {  // a joint's centre
    const int row = rig.skeleton.find_joint(value.text());
    if (row < 0) value.fail_unknown("joint", value.text(), joint_names(rig.skeleton));
    const auto r = static_cast<std::size_t>(row);
    return {r, segments[r].joint.center};
  }
  constexpr std::array<std::string_view, 2> keys{"segment", "point"};
  value.allow(keys);
  const Value segment = value.at("segment");
  const int row = rig.skeleton.find_segment(segment.text());
  if (row < 0) segment.fail_unknown("segment", segment.text(), segment_names(rig.skeleton));
  const auto [x, y, z] = value.at("point").numbers<3>();
  return {static_cast<std::size_t>(row), {x, y, z}};
}

MotionMap parse(const Value& file, const Rig& rig, bool strict) {
  constexpr std::array<std::string_view, 4> keys{"ecorche_motion_map", "joints", "angles", "markers"};
  file.allow(keys);
  const Value version = file.at("ecorche_motion_map");
  if (version.text() != "1")
    version.fail("version '" + version.text() + "' is not known", "this ecorche reads version 1");
  MotionMap map;
  if (const auto joints = file.find("joints")) {
    for (const auto& [joint, value] : joints->pairs()) {
      const std::string segment = value.kind() == yaml::Kind::null ? "" : value.text();
      if (!segment.empty() && rig.skeleton.find_segment(segment) < 0)
        value.fail_unknown("segment", segment, segment_names(rig.skeleton));
      map.joints[joint] = segment;
    }
  }
  if (const auto angles = file.find("angles")) {
    for (const auto& [column, list] : angles->pairs()) {
      std::vector<AngleShare> shares = read_shares(list, rig, strict);
      if (!shares.empty()) map.angles[column] = std::move(shares);
    }
  }
  if (const auto markers = file.find("markers")) {
    for (const auto& [marker, value] : markers->pairs()) map.markers[marker] = read_marker(value, rig);
  }
  return map;
}

}  // namespace

MotionMap read_motion_map(const std::filesystem::path& path, const Rig& rig) {
  return parse(Value::read(path), rig, true);
}

MotionMap opensim_map(const Rig& rig) {
  return parse(Value::parse(embedded::opensim, "OpenSim's coordinates"), rig, false);
}

}  // namespace ecorche::io
