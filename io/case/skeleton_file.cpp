// SPDX-License-Identifier: Apache-2.0
#include "io/case/skeleton_file.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <ecorche/io/case_file.hpp>
#include "core/values/identifier.hpp"
#include "io/case/joint_axes.hpp"
#include "io/case/yaml_text.hpp"

namespace ecorche::io {
namespace {

using yaml::Kind;
using yaml::Value;

std::vector<std::string> strings(std::span<const std::string_view> words) {
  return {words.begin(), words.end()};
}

std::vector<std::string> angle_names(const Joint& joint) {
  std::vector<std::string> names;
  for (const AngleAxis& angle : joint.sequence) names.push_back(angle.name);
  return names;
}

AngleAxis* find_angle(Joint& joint, std::string_view name) {
  const auto found = std::find_if(joint.sequence.begin(), joint.sequence.end(),
                                  [&](const AngleAxis& angle) { return angle.name == name; });
  return found == joint.sequence.end() ? nullptr : &*found;
}

JointKind read_kind(const Value& value) {
  const auto& kinds = skeleton_keys::kinds;
  const auto found = std::find(kinds.begin(), kinds.end(), value.text());
  if (found == kinds.end()) value.fail_unknown("kind of joint", value.text(), strings(kinds));
  return static_cast<JointKind>(found - kinds.begin());
}

// A sphere between two bones needs no more than their names; whatever else is found goes by a rule.
void keep_rule(JointRule rule, Joint& joint) {
  const PointSource& center = rule.center;
  joint.rule = center.rule;
  joint.center = center.point;
  const bool two_bones = center.rule == CenterRule::sphere_fit && !center.on.facing.empty();
  if (two_bones) {
    joint.center_bone = center.on.bone;
    joint.facing_bone = center.on.facing;
  }
  const bool said = center.rule == CenterRule::given || two_bones;
  if (!said || !rule.axes.empty() || rule.measured_rest || !rule.possible.none())
    joint.how = std::make_shared<const JointRule>(std::move(rule));
}

AngleAxis read_angle(const Value& value) {
  const auto pairs = value.pairs();
  if (pairs.size() != 1)
    value.fail("names " + std::to_string(pairs.size()) + " angles", "write one, as {flexion: x}");
  const auto& [name, axis] = pairs.front();
  if (!is_identifier(name) || name == "source") {
    axis.fail("'" + name + "' cannot name an angle", "use 1 to 64 of a-z, 0-9 and _, but not 'source'");
  }
  AngleAxis angle;
  angle.name = name;
  std::string_view letter = axis.text();
  if (letter.starts_with('-')) {
    angle.sign = -1;
    letter.remove_prefix(1);
  }
  if (letter.size() != 1 || letter[0] < 'x' || letter[0] > 'z') {
    axis.fail("'" + axis.text() + "' is no axis", "use x, y, z, or -x, -y, -z");
  }
  angle.axis = letter[0] - 'x';
  return angle;
}

// Up to three turns; those left out follow, named after their axes: a hinge need not name what it cannot do.
void read_sequence(const Value& value, Joint& joint) {
  const auto items = value.items();
  if (items.empty() || items.size() > 3) {
    value.fail("has " + std::to_string(items.size()) + " turns", "write one to three");
  }
  joint.sequence.clear();
  for (const Value& item : items) {
    const AngleAxis angle = read_angle(item);
    for (const AngleAxis& other : joint.sequence) {
      if (other.axis == angle.axis)
        item.fail("turns about the same axis again", "each turn has its own axis");
      if (other.name == angle.name)
        item.fail("the angle '" + angle.name + "' stands twice", "give it another name");
    }
    joint.sequence.push_back(angle);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const bool used = std::any_of(joint.sequence.begin(), joint.sequence.end(),
                                  [&](const AngleAxis& angle) { return angle.axis == axis; });
    if (used) continue;
    const std::string name(skeleton_keys::axes[static_cast<std::size_t>(axis)]);
    if (find_angle(joint, name) != nullptr) {
      value.fail("the angle '" + name + "' is named like another axis", "name all three turns");
    }
    joint.sequence.push_back({.name = name, .axis = axis});
  }
}

void read_rest(const Value& value, Joint& joint) {
  for (const auto& [name, degrees] : value.pairs()) {
    AngleAxis* angle = find_angle(joint, name);
    if (angle == nullptr) degrees.fail_unknown("angle", name, angle_names(joint));
    angle->rest = degrees.degrees();
  }
}

void read_limits(const Value& value, Joint& joint) {
  for (const auto& [name, range] : value.pairs()) {
    if (name == "source") {
      joint.limits_source = range.text();
      continue;
    }
    AngleAxis* angle = find_angle(joint, name);
    if (angle == nullptr) {
      auto known = angle_names(joint);
      known.emplace_back("source");
      range.fail_unknown("angle", name, known);
    }
    const auto bounds = range.items();
    if (bounds.size() != 2)
      range.fail("has " + std::to_string(bounds.size()) + " values", "write [least, most] in degrees");
    if (bounds[0].kind() != Kind::null) angle->min = bounds[0].degrees();
    if (bounds[1].kind() != Kind::null) angle->max = bounds[1].degrees();
    if (angle->min > angle->max) range.fail("the least angle is above the most", "write [least, most]");
  }
}

void check_rest(const Value& value, const Joint& joint) {
  for (const AngleAxis& angle : joint.sequence) {
    if (angle.rest < angle.min || angle.rest > angle.max) {
      value.fail("the rest angle of '" + angle.name + "', " + yaml::write_degrees(angle.rest) +
                     " degrees, is outside its limits",
                 "widen limits_deg or mend rest_deg: the scanned pose must be allowed");
    }
  }
}

Joint read_joint(const Value& value, const Frame& frame, NamedInRules& named, const std::string& segment) {
  value.allow(skeleton_keys::joint);
  Joint joint;
  joint.name = value.at("name").identifier();
  if (const auto kind = value.find("kind")) joint.kind = read_kind(*kind);
  const RuleReader reader(frame, segment, named);
  JointRule rule;
  rule.center = reader.point(value.at("center"));
  if (const auto axes = value.find("axes")) {
    if (RuleReader::has_rules(*axes)) {
      rule.axes = reader.axes(*axes);
    } else {
      joint.axes = read_joint_axes(*axes, frame);
    }
  }
  joint.sequence = {{.name = "x", .axis = 0}, {.name = "y", .axis = 1}, {.name = "z", .axis = 2}};
  if (const auto sequence = value.find("sequence")) read_sequence(*sequence, joint);
  if (const auto rest = value.find("rest_deg")) {
    rule.measured_rest = rest->kind() == Kind::scalar && rest->text() == "measured";
    if (!rule.measured_rest) read_rest(*rest, joint);
  }
  if (const auto limits = value.find("limits_deg")) read_limits(*limits, joint);
  if (!rule.measured_rest) check_rest(value, joint);
  if (const auto possible = value.find("possible")) rule.possible = read_bounds(*possible, joint.sequence);
  keep_rule(std::move(rule), joint);
  return joint;
}

// After all joints are known: a rhythm names another joint.
void read_couplings(const Value& value, Skeleton& skeleton, Joint& joint) {
  std::vector<std::string> joints;
  for (const Segment& segment : skeleton.segments) joints.push_back(segment.joint.name);
  for (const Value& item : value.items()) {
    item.allow(skeleton_keys::coupling);
    Coupling coupling;
    const Value leader = item.at("joint");
    coupling.joint = leader.text();
    const int row = skeleton.find_joint(coupling.joint);
    if (row < 0) leader.fail_unknown("joint", coupling.joint, joints);
    Joint& leading = skeleton.segments[static_cast<std::size_t>(row)].joint;
    const Value angle = item.at("angle"), drives = item.at("drives");
    coupling.drives = drives.text();
    const bool slides = coupling.slides() >= 0 && find_angle(joint, coupling.drives) == nullptr;
    if (leading.name == joint.name && !slides)
      leader.fail("a joint cannot lead itself", "name another joint");
    coupling.angle = angle.text();
    if (find_angle(leading, coupling.angle) == nullptr)
      angle.fail_unknown("angle", coupling.angle, angle_names(leading));
    if (find_angle(joint, coupling.drives) == nullptr && !slides)
      drives.fail_unknown("angle", coupling.drives, angle_names(joint));
    coupling.ratio = item.at("ratio").number();
    joint.coupled.push_back(coupling);
  }
}

// Whether following the leaders from `start` comes back to it.
bool leads_itself(const Skeleton& skeleton, const std::string& start) {
  std::set<std::string> seen;
  std::vector<std::string> open{start};
  while (!open.empty()) {
    const std::string name = open.back();
    open.pop_back();
    for (const Coupling& coupling :
         skeleton.segments[static_cast<std::size_t>(skeleton.find_joint(name))].joint.coupled) {
      if (coupling.slides() >= 0) continue;  // a slide leads nothing
      if (coupling.joint == start) return true;
      if (seen.insert(coupling.joint).second) open.push_back(coupling.joint);
    }
  }
  return false;
}

using Named = std::vector<std::pair<std::string, Value>>;

// Rows of the file in an order with parents first: file order wherever that allows.
std::vector<std::size_t> parents_first(const Named& segments, const std::vector<int>& parents) {
  std::vector<std::size_t> order;
  std::vector<bool> placed(segments.size(), false);
  for (std::size_t before = 0; order.size() < segments.size(); before = order.size()) {
    for (std::size_t i = 0; i < segments.size(); ++i) {
      if (placed[i] || (parents[i] >= 0 && !placed[static_cast<std::size_t>(parents[i])])) continue;
      placed[i] = true;
      order.push_back(i);
    }
    if (order.size() > before) continue;
    const auto open =
        static_cast<std::size_t>(std::find(placed.begin(), placed.end(), false) - placed.begin());
    segments[open].second.at("parent").fail("'" + segments[open].first + "' is among its own ancestors",
                                            "parents must lead to the root");
  }
  return order;
}

// The file row of every segment's parent, -1 for the one root.
std::vector<int> read_parents(const Value& map, const Named& segments) {
  std::vector<std::string> names;
  for (const auto& segment : segments) names.push_back(segment.first);
  std::vector<int> parents;
  int root = -1;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const auto& [name, value] = segments[i];
    value.allow(skeleton_keys::segment);
    const auto parent = value.find("parent");
    if (!parent) {
      if (root >= 0) {
        value.fail("'" + name + "' has no parent, but '" + names[static_cast<std::size_t>(root)] +
                       "' is the root already",
                   "give it a parent");
      }
      root = static_cast<int>(i);
      parents.push_back(-1);
      continue;
    }
    const auto found = std::find(names.begin(), names.end(), parent->text());
    if (found == names.end()) parent->fail_unknown("segment", parent->text(), names);
    parents.push_back(static_cast<int>(found - names.begin()));
  }
  if (root < 0) map.fail("every segment has a parent", "leave out the parent of the root");
  return parents;
}

// Rules may name segments and joints that stand further below.
void check_names(const Skeleton& skeleton, const NamedInRules& named) {
  std::vector<std::string> segments, joints;
  for (const Segment& segment : skeleton.segments) {
    segments.push_back(segment.name);
    joints.push_back(segment.joint.name);
  }
  for (const NamedInRules::Word& word : named.segments) {
    if (skeleton.find_segment(word.value.text()) < 0)
      word.value.fail_unknown("segment", word.value.text(), segments);
  }
  for (const NamedInRules::Word& word : named.joints) {
    if (skeleton.find_joint(word.value.text()) < 0)
      word.value.fail_unknown("joint", word.value.text(), joints);
  }
}

}  // namespace

PlacedSkeleton parse_skeleton(const Value& root, const Frame& frame) {
  root.allow(skeleton_keys::file);
  const Value version = root.at("ecorche_skeleton");
  if (version.text() != "1")
    version.fail("version '" + version.text() + "' is not known", "this ecorche reads version 1");
  PlacedSkeleton placed;
  Skeleton& skeleton = placed.skeleton;
  skeleton.name = root.at("name").text();
  if (const auto size = root.find("size_mm")) placed.size = read_size(*size);
  const Value map = root.at("segments");
  const Named segments = map.pairs();
  if (segments.empty()) map.fail("is empty", "a skeleton has at least a root");
  if (segments.size() > 4096)
    map.fail("has " + std::to_string(segments.size()) + " segments", "4096 are the most");
  const std::vector<int> parents = read_parents(map, segments);
  const std::vector<std::size_t> order = parents_first(segments, parents);
  std::vector<int> row_of(segments.size());
  for (const std::size_t i : order) {
    const auto& [name, value] = segments[i];
    if (!is_identifier(name)) value.fail("'" + name + "' is no identifier", "use 1 to 64 of a-z, 0-9 and _");
    Segment segment;
    segment.name = name;
    segment.parent = parents[i] < 0 ? -1 : row_of[static_cast<std::size_t>(parents[i])];
    const Value joint = value.at("joint");
    segment.joint = read_joint(joint, frame, placed.named, name);
    if (skeleton.find_joint(segment.joint.name) >= 0) {
      joint.at("name").fail("another joint is named '" + segment.joint.name + "'",
                            "give each joint its own name");
    }
    if (const auto aliases = value.find("aliases")) {
      for (const Value& alias : aliases->items()) segment.aliases.push_back(alias.text());
    }
    if (const auto bones = value.find("bones")) {
      if (bones->text() != "none")
        bones->fail("'" + bones->text() + "' is not known", "write bones: none, or leave it out");
      segment.boneless = true;
    }
    row_of[i] = static_cast<int>(skeleton.segments.size());
    skeleton.segments.push_back(std::move(segment));
  }
  for (const auto& [name, value] : segments) {
    const auto coupled = value.at("joint").find("coupled");
    if (!coupled) continue;
    Joint& joint = skeleton.segments[static_cast<std::size_t>(skeleton.find_segment(name))].joint;
    read_couplings(*coupled, skeleton, joint);
    if (leads_itself(skeleton, joint.name))
      coupled->fail("'" + joint.name + "' leads itself in a circle", "break the circle");
  }
  check_names(skeleton, placed.named);
  if (const auto regions = root.find("regions")) placed.regions = parse_regions(*regions, frame);
  std::vector<std::string> names;
  for (const Segment& segment : skeleton.segments) names.push_back(segment.name);
  for (const PlacedRegion& region : placed.regions) need_segments(region, names);
  return placed;
}

Skeleton read_skeleton(const std::filesystem::path& path) {
  return parse_skeleton(Value::read(path), Frame{}).skeleton;
}

}  // namespace ecorche::io
