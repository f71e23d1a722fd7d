// SPDX-License-Identifier: Apache-2.0
#include "io/case/ik_file.hpp"

#include <array>
#include <cmath>

#include <ecorche/io/case_file.hpp>
#include <ecorche/io/pose_library.hpp>
#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "io/case/pose_file.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {
namespace {

using Eigen::Vector3d;
using yaml::Value;

constexpr double kPinned = 3;  // times the weight of a target
constexpr std::size_t kMost = 1000;

// A segment and a point of it on the scanned body; the joint's centre where none is named.
struct Place {
  std::size_t row = 0;
  Vector3d point;
  std::string name;
};

Place read_place(const Value& value, const Rig& rig) {
  const Value segment = value.at("segment");
  const int row = rig.skeleton.find_segment(segment.text());
  if (row < 0) {
    std::vector<std::string> known;
    for (const Segment& s : rig.skeleton.segments) known.push_back(s.name);
    segment.fail_unknown("segment", segment.text(), known);
  }
  Place out{static_cast<std::size_t>(row), rig.skeleton.segments[static_cast<std::size_t>(row)].joint.center,
            segment.text()};
  if (const auto point = value.find("point")) out.point = yaml::vector(*point);
  return out;
}

double read_weight(const Value& value, double otherwise) {
  const auto weight = value.find("weight");
  if (!weight) return otherwise;
  if (!(weight->number() > 0 && weight->number() <= 1000))
    weight->fail("is " + weight->text(), "write a number above 0, 1000 at most");
  return weight->number();
}

std::vector<Value> list(const Value& file, std::string_view key) {
  const auto found = file.find(key);
  if (!found) return {};
  std::vector<Value> items = found->items();
  if (items.size() > kMost)
    found->fail("has " + std::to_string(items.size()) + " entries", "1000 are the most");
  return items;
}

Pose read_start(const Value& file, const std::filesystem::path& folder, const Rig& rig, IkRequest& out) {
  const auto start = file.find("start");
  if (!start) return Pose::rest(rig.skeleton.segments.size());
  const std::string& name = start->text();
  if (!name.starts_with(library_prefix)) return read_pose(folder / name, rig);
  LibraryPose pose = library_pose(std::string_view(name).substr(library_prefix.size()), rig);
  out.left_out = std::move(pose.left_out);
  return std::move(pose.pose);
}

}  // namespace

IkRequest read_ik(const std::filesystem::path& path, const Rig& rig) {
  constexpr std::array<std::string_view, 7> keys{"ecorche_ik", "skeleton", "start",  "move_root",
                                                 "pinned",     "targets",  "look_at"};
  const Value file = Value::read(path);
  file.allow(keys);
  check_head(file, "ecorche_ik", rig.skeleton);
  IkRequest out;
  out.start = read_start(file, path.parent_path(), rig, out);
  if (const auto move = file.find("move_root")) {
    const std::vector<std::string> known{"true", "false"};
    if (move->text() != known[0] && move->text() != known[1])
      move->fail_unknown("value", move->text(), known);
    out.problem.move_root = move->text() == "true";
  }
  std::vector<ClampedJoint> clamped;
  Pose begin = out.start;
  kinematics::constrain(rig.skeleton, begin, clamped);
  const std::vector<RigidTransform> motion = kinematics::forward(rig, begin);
  for (const Value& item : list(file, "targets")) {
    constexpr std::array<std::string_view, 4> target_keys{"segment", "point", "goal", "weight"};
    item.allow(target_keys);
    const Place place = read_place(item, rig);
    out.problem.targets.push_back(
        {place.row, place.point, yaml::vector(item.at("goal")), read_weight(item, 1)});
    out.names.push_back(place.name);
  }
  for (const Value& item : list(file, "pinned")) {
    constexpr std::array<std::string_view, 3> pin_keys{"segment", "point", "weight"};
    item.allow(pin_keys);
    const Place place = read_place(item, rig);
    out.problem.targets.push_back(
        {place.row, place.point, motion[place.row] * place.point, read_weight(item, kPinned)});
    out.names.push_back(place.name + " (pinned)");
  }
  for (const Value& item : list(file, "look_at")) {
    constexpr std::array<std::string_view, 5> look_keys{"segment", "point", "direction", "at", "weight"};
    item.allow(look_keys);
    const Place place = read_place(item, rig);
    kinematics::IkLook look{place.row, place.point, -Vector3d::UnitY(), yaml::vector(item.at("at")),
                            read_weight(item, 1)};
    if (const auto direction = item.find("direction")) {
      look.direction = yaml::vector(*direction);
      if (!(look.direction.norm() > 1e-6)) direction->fail("has no length", "write for example [0, -1, 0]");
      look.direction.normalize();
    }
    out.problem.looks.push_back(look);
    out.names.push_back(place.name + " (looks)");
  }
  if (out.names.empty()) file.fail("asks for nothing", "write targets or look_at");
  return out;
}

}  // namespace ecorche::io
