// SPDX-License-Identifier: Apache-2.0
#include "io/case/joint_rule_file.hpp"

#include <algorithm>

#include "io/case/skeleton_file.hpp"

namespace ecorche::io {
namespace {

using yaml::Kind;
using yaml::Value;

constexpr double kLeastLength = 1e-12;

Eigen::Vector3d direction_of(const Value& value, const Frame& frame) {
  const Eigen::Vector3d file = yaml::vector(value);
  if (file.stableNorm() < kLeastLength) value.fail("has no length", "write a direction");
  return frame.axes * file.stableNormalized();
}

// The one key of `value` that names a source; the others are its options.
std::string_view chosen(const Value& value, std::initializer_list<std::string_view> options) {
  std::string_view found;
  for (const std::string_view word : skeleton_keys::center) {
    if (std::find(options.begin(), options.end(), word) != options.end() || !value.find(word)) continue;
    if (!found.empty())
      value.fail("names both '" + std::string(found) + "' and '" + std::string(word) + "'", "keep one");
    found = word;
  }
  return found;
}

CenterRule rule_of(std::string_view word) {
  const auto found = std::find(center_rule_names.begin(), center_rule_names.end(), word);
  return static_cast<CenterRule>(found - center_rule_names.begin());
}

}  // namespace

RegionUse RuleReader::use(const Value& value) const {
  value.allow(skeleton_keys::use);
  RegionUse use;
  const auto word = [&](std::string_view key, std::string& to, std::vector<NamedInRules::Word>& list) {
    const auto name = value.find(key);
    if (!name) return;
    to = name->identifier();
    list.push_back({segment_, *name});
  };
  word("region", use.region, named_.regions);
  word("bone", use.bone, named_.bones);
  word("facing", use.facing, named_.bones);
  word("segment", use.segment, named_.segments);
  word("facing_segment", use.facing_segment, named_.segments);
  if (const auto along = value.find("along")) {
    use.along = direction_of(*along, frame_);
    if (use.facing_segment.empty())
      along->fail("is for vertices that face another segment", "name that segment");
  }
  const int ways = int{!use.region.empty()} + int{!use.bone.empty()} + int{!use.segment.empty()};
  if (ways != 1) value.fail("names " + std::to_string(ways) + " places", "name one region, bone or segment");
  if ((!use.facing.empty() && use.bone.empty()) || (!use.facing_segment.empty() && use.segment.empty()))
    value.fail("faces what is of another kind", "write bone with facing, or segment with facing_segment");
  if (const auto looks = value.find("looks")) {
    use.looks = direction_of(*looks, frame_);
    if (use.facing.empty() && use.facing_segment.empty())
      looks->fail("is for vertices that face another bone", "name what they face");
  }
  if (!use.bone.empty() && use.bone == use.facing) value.fail("a bone cannot face itself", "name two bones");
  if (!use.segment.empty() && use.segment == use.facing_segment)
    value.fail("a segment cannot face itself", "name two segments");
  return use;
}

PointSource RuleReader::point(const Value& value) const {
  PointSource source;
  if (value.kind() != Kind::map) {
    source.point = frame_.point(yaml::vector(value));
    return source;
  }
  value.allow(skeleton_keys::center);
  const std::string_view word = chosen(value, {"at"});
  if (word.empty()) value.fail("names no source", "use sphere_fit, centroid, between, ...");
  if (value.find("at") && word != "between") value.at("at").fail("belongs to between", "leave it out");
  source.rule = rule_of(word);
  const Value inside = value.at(word);
  if (word == "joint") {
    source.joint = inside.identifier();
    named_.joints.push_back({segment_, inside});
  } else if (word == "any" || word == "between") {
    for (const Value& part : inside.items()) source.parts.push_back(point(part));
    if (word == "any" && source.parts.empty()) inside.fail("is empty", "list one source at least");
    if (word == "between" && source.parts.size() != 2)
      inside.fail("has " + std::to_string(source.parts.size()) + " ends", "write two");
    if (const auto at = value.find("at")) source.share = at->number();
  } else {
    source.on = use(inside);
  }
  return source;
}

DirectionSource RuleReader::direction(const Value& value, int axis) const {
  using DirectionKind = DirectionSource::Kind;
  DirectionSource source;
  source.direction = Eigen::Vector3d::Unit(axis);
  if (value.kind() != Kind::map) {
    source.direction = direction_of(value, frame_);
    return source;
  }
  value.allow(skeleton_keys::direction);
  if (const auto choices = value.find("any")) {
    source.kind = DirectionKind::first_good;
    for (const Value& choice : choices->items()) source.choices.push_back(direction(choice, axis));
    if (source.choices.empty()) choices->fail("is empty", "list one source at least");
  } else if (const auto joint = value.find("axis_of")) {
    source.kind = DirectionKind::axis_of;
    source.joint = joint->identifier();
    named_.joints.push_back({segment_, *joint});
  } else if (value.find("from") || value.find("to")) {
    source.kind = DirectionKind::towards;
    source.from = point(value.at("from"));
    source.to = point(value.at("to"));
  } else {
    source.kind = DirectionKind::fit;
    const std::string_view word = chosen(value, {});
    if (word.empty()) value.fail("names no direction", "use cylinder_fit, from and to, axis_of, ...");
    source.from.rule = rule_of(word);
    source.from.on = use(value.at(word));
    if (const auto towards = value.find("towards")) source.direction = direction_of(*towards, frame_);
  }
  return source;
}

bool RuleReader::has_rules(const Value& axes) {
  const auto pairs = axes.pairs();
  return std::any_of(pairs.begin(), pairs.end(),
                     [](const auto& pair) { return pair.second.kind() == Kind::map; });
}

std::vector<std::pair<int, DirectionSource>> RuleReader::axes(const Value& value) const {
  value.allow(skeleton_keys::axes);
  std::vector<std::pair<int, DirectionSource>> out;
  for (const auto& [letter, axis] : value.pairs()) {
    const int index = letter[0] - 'x';
    out.emplace_back(index, direction(axis, index));
  }
  if (out.size() != 2) value.fail("names " + std::to_string(out.size()) + " axes", "name two of x, y, z");
  return out;
}

}  // namespace ecorche::io
