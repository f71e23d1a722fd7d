// SPDX-License-Identifier: Apache-2.0
#include "io/case/attachment_file.hpp"

#include "io/case/yaml_reader.hpp"

namespace ecorche::io {
namespace {

using yaml::Value;

double positive(const Value& value) {
  const double x = value.number();
  if (!(x > 0)) value.fail("is not positive", "give a length in mm");
  return x;
}

std::string known_segment(const Value& value, const Skeleton& skeleton) {
  const std::string& name = value.text();
  if (skeleton.find_segment(name) < 0) {
    std::vector<std::string> known;
    for (const Segment& segment : skeleton.segments) known.push_back(segment.name);
    value.fail_unknown("segment", name, known);
  }
  return name;
}

AttachmentSplit read_split(const Value& value, const Skeleton& skeleton) {
  constexpr std::array<std::string_view, 2> keys{"joint", "within_mm"};
  value.allow(keys);
  const Value joint = value.at("joint");
  const int row = skeleton.find_joint(joint.text());
  if (row < 0) {
    std::vector<std::string> known;
    for (const Segment& segment : skeleton.segments) known.push_back(segment.joint.name);
    joint.fail_unknown("joint", joint.text(), known);
  }
  if (skeleton.segments[static_cast<std::size_t>(row)].parent < 0)
    joint.fail("'" + joint.text() + "' is the root's joint", "split at a joint between two segments");
  return {joint.text(), positive(value.at("within_mm"))};
}

AttachmentRegion read_region(const Value& value, const Skeleton& skeleton) {
  constexpr std::array<std::string_view, 4> keys{"segment", "from", "box", "ball"};
  constexpr std::array<std::string_view, 2> ball_keys{"center", "radius_mm"};
  value.allow(keys);
  AttachmentRegion region;
  region.segment = known_segment(value.at("segment"), skeleton);
  if (const auto from = value.find("from")) region.from = known_segment(*from, skeleton);
  const auto box = value.find("box"), ball = value.find("ball");
  if (box.has_value() == ball.has_value()) value.fail("has not one of box and ball", "give one of them");
  if (box) {
    const std::vector<Value> corners = box->items();
    if (corners.size() != 2) box->fail("has not two corners", "write [[x, y, z], [x, y, z]]");
    region.box = {corners[0].numbers<3>(), corners[1].numbers<3>()};
    for (std::size_t a = 0; a < 3; ++a) {
      if ((*region.box)[0][a] > (*region.box)[1][a]) box->fail("is empty", "the lower corner comes first");
    }
  } else {
    ball->allow(ball_keys);
    region.center = ball->at("center").numbers<3>();
    region.radius = positive(ball->at("radius_mm"));
  }
  return region;
}

}  // namespace

Reassignment read_attachment(const std::filesystem::path& path, const Skeleton& skeleton) {
  constexpr std::array<std::string_view, 3> keys{"ecorche_attachment", "splits", "regions"};
  const Value file = Value::read(path);
  file.allow(keys);
  const Value version = file.at("ecorche_attachment");
  if (version.text() != "1")
    version.fail("version '" + version.text() + "' is not known", "this ecorche reads version 1");
  Reassignment out;
  if (const auto splits = file.find("splits")) {
    for (const Value& split : splits->items()) out.splits.push_back(read_split(split, skeleton));
  }
  if (const auto regions = file.find("regions")) {
    for (const Value& region : regions->items()) out.regions.push_back(read_region(region, skeleton));
  }
  return out;
}

}  // namespace ecorche::io
