// SPDX-License-Identifier: Apache-2.0
// Sources and regions as YAML that reads back the same.
#include "io/case/joint_rule_file.hpp"
#include "io/case/yaml_text.hpp"

namespace ecorche::io {
namespace {

using yaml::write_text;
using yaml::write_vector;

std::string word(std::string_view key, const std::string& name) {
  return name.empty() ? "" : std::string(key) + ": " + write_text(name);
}

std::string use_to_yaml(const RegionUse& use) {
  std::string out;
  for (const std::string& part :
       {word("region", use.region), word("bone", use.bone), word("facing", use.facing),
        word("segment", use.segment), word("facing_segment", use.facing_segment)}) {
    if (!part.empty()) out += (out.empty() ? "" : ", ") + part;
  }
  if (!use.looks.isZero()) out += ", looks: " + write_vector(use.looks);
  if (!use.along.isZero()) out += ", along: " + write_vector(use.along);
  return "{" + out + "}";
}

template <class List, class F>
std::string joined(const List& list, F&& text) {
  std::string out;
  for (const auto& item : list) out += (out.empty() ? "" : ", ") + text(item);
  return out;
}

std::string direction_to_yaml(const DirectionSource& source) {
  using enum DirectionSource::Kind;
  switch (source.kind) {
    case fit:
      return "{" + std::string(center_rule_name(source.from.rule)) + ": " + use_to_yaml(source.from.on) +
             ", towards: " + write_vector(source.direction) + "}";
    case towards:
      return "{from: " + point_to_yaml(source.from) + ", to: " + point_to_yaml(source.to) + "}";
    case axis_of:
      return "{" + word("axis_of", source.joint) + "}";
    case first_good:
      return "{any: [" + joined(source.choices, direction_to_yaml) + "]}";
    case given:
      break;
  }
  return write_vector(source.direction);
}

std::string box_to_yaml(const Eigen::AlignedBox3d& box) {
  return "{least: " + write_vector(box.min()) + ", most: " + write_vector(box.max()) + "}";
}

std::string row_to_yaml(const Points& points, Eigen::Index row) {
  return write_vector(points.row(row).transpose());
}

}  // namespace

std::string point_to_yaml(const PointSource& source) {
  const std::string rule(center_rule_name(source.rule));
  switch (source.rule) {
    case CenterRule::given:
      return write_vector(source.point);
    case CenterRule::between:
      return "{between: [" + joined(source.parts, point_to_yaml) +
             "], at: " + yaml::write_number(source.share) + "}";
    case CenterRule::first_good:
      return "{any: [" + joined(source.parts, point_to_yaml) + "]}";
    case CenterRule::joint:
      return "{" + word("joint", source.joint) + "}";
    default:
      return "{" + rule + ": " + use_to_yaml(source.on) + "}";
  }
}

std::string axes_to_yaml(const std::vector<std::pair<int, DirectionSource>>& axes) {
  return "{" +
         joined(axes,
                [](const auto& axis) {
                  return std::string(1, static_cast<char>('x' + axis.first)) + ": " +
                         direction_to_yaml(axis.second);
                }) +
         "}";
}

std::string regions_to_yaml(const std::vector<Region>& regions) {
  std::string out = "ecorche_regions: 1\nregions:\n";
  for (const Region& region : regions) {
    out += "  " + write_text(region.name) + ": {";
    out += region.bone.empty() ? word("segment", region.segment) : word("bone", region.bone);
    if (!region.boxes.empty()) {
      out += ", boxes: [" + joined(region.boxes, box_to_yaml) + "]";
      if (region.of_bones) out += ", of: bones";
      if (!region.near.empty()) out += ", " + word("near", region.near);
      if (!region.along.isZero()) out += ", along: " + write_vector(region.along);
    }
    if (region.points.rows() > 0) {
      out += ", points: [";
      for (Eigen::Index row = 0; row < region.points.rows(); ++row)
        out += (row > 0 ? ", " : "") + row_to_yaml(region.points, row);
      out += "]";
    }
    out += "}\n";
  }
  return out;
}

}  // namespace ecorche::io
