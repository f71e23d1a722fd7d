// SPDX-License-Identifier: Apache-2.0
// Named regions of bones: `regions.yaml` of a case, or `regions` of a skeleton.
#include <algorithm>

#include "core/values/identifier.hpp"
#include "io/case/joint_rule_file.hpp"
#include "io/case/skeleton_file.hpp"

namespace ecorche::io {
namespace {

using yaml::Value;

constexpr std::array<std::string_view, 2> kBoxKeys{"least", "most"};

Eigen::Vector3d corner(const Value& value, const Frame& frame) {
  const auto numbers = value.numbers<3>();
  return frame.point({numbers[0], numbers[1], numbers[2]});
}

Eigen::AlignedBox3d read_box(const Value& value, const Frame& frame) {
  value.allow(kBoxKeys);
  const Value least = value.at("least"), most = value.at("most");
  const auto low = least.numbers<3>(), high = most.numbers<3>();
  for (std::size_t i = 0; i < 3; ++i) {
    if (low[i] > high[i]) value.fail("its least is above its most", "write the smaller corner first");
  }
  Eigen::AlignedBox3d box;
  box.extend(corner(least, frame));
  box.extend(corner(most, frame));
  return box;
}

PlacedRegion read_region(const std::string& name, const Value& value, const Frame& frame) {
  value.allow(skeleton_keys::region);
  PlacedRegion placed{{}, value, {}};
  Region& region = placed.region;
  region.name = name;
  if (!is_identifier(name)) value.fail("'" + name + "' is no identifier", "use 1 to 64 of a-z, 0-9 and _");
  const auto bone = value.find("bone"), segment = value.find("segment");
  if (bone.has_value() == segment.has_value())
    value.fail("is on no one place", "name its bone or its segment");
  if (bone) region.bone = bone->identifier();
  if (segment) region.segment = segment->identifier();
  if (const auto of = value.find("of")) {
    if (of->text() != "bones")
      of->fail("'" + of->text() + "' holds no boxes", "write of: bones, or leave it out");
    region.of_bones = true;
  }
  if (const auto near = value.find("near")) {
    region.near = near->identifier();
    if (region.of_bones) near->fail("says again where boxes lie", "keep of or near");
    if (region.near == region.segment) near->fail("is the region's own segment", "name its neighbour");
    if (!value.find("boxes")) near->fail("is for boxes", "list boxes, or leave it out");
  }
  if (const auto along = value.find("along")) {
    if (region.near.empty()) along->fail("is for boxes near a segment", "name it by near, or leave it out");
    const auto numbers = along->numbers<3>();
    region.along = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
    if (!(region.along.norm() > 0)) along->fail("has no length", "write a direction");
    region.along.normalize();
  }
  if (const auto boxes = value.find("boxes")) {
    for (const Value& box : boxes->items())
      region.boxes.push_back(read_box(box, region.of_bones || !region.near.empty() ? Frame{} : frame));
  }
  if (const auto vertices = value.find("vertices")) {
    if (!bone) vertices->fail("count the vertices of a bone", "name the region's bone");
    for (const Value& vertex : vertices->items()) placed.vertices.push_back(vertex.integer());
  }
  if (const auto points = value.find("points")) {
    const auto items = points->items();
    region.points.resize(static_cast<Eigen::Index>(items.size()), 3);
    for (std::size_t i = 0; i < items.size(); ++i)
      region.points.row(static_cast<Eigen::Index>(i)) = corner(items[i], frame).transpose();
  }
  if (region.boxes.empty() && placed.vertices.empty() && region.points.rows() == 0)
    value.fail("holds nothing", "list boxes, vertices or points");
  return placed;
}

}  // namespace

void need_segments(const PlacedRegion& placed, const std::vector<std::string>& segments) {
  const auto need = [&](const char* key, const std::string& name) {
    if (!name.empty() && std::find(segments.begin(), segments.end(), name) == segments.end())
      placed.value.at(key).fail_unknown("segment", name, segments);
  };
  need("segment", placed.region.segment);
  need("near", placed.region.near);
}

std::vector<PlacedRegion> parse_regions(const Value& value, const Frame& frame) {
  std::vector<PlacedRegion> out;
  for (const auto& [name, region] : value.pairs()) out.push_back(read_region(name, region, frame));
  return out;
}

}  // namespace ecorche::io
