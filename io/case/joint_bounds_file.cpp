// SPDX-License-Identifier: Apache-2.0
// What a skeleton file says is possible: of joints as they are found, and of a body's size.
#include <algorithm>
#include <cmath>

#include "io/case/joint_rule_file.hpp"
#include "io/case/skeleton_file.hpp"
#include "io/case/yaml_text.hpp"

namespace ecorche::io {
namespace {

using yaml::Kind;
using yaml::Value;
using Range = JointBounds::Range;

// [least, most], null for no bound; `number` reads one.
template <class F>
Range read_range(const Value& value, F&& number) {
  const auto ends = value.items();
  if (ends.size() != 2)
    value.fail("is a range of " + std::to_string(ends.size()) + " values", "write [least, most]");
  Range range;
  if (ends[0].kind() != Kind::null) range.least = number(ends[0]);
  if (ends[1].kind() != Kind::null) range.most = number(ends[1]);
  if (range.least > range.most) value.fail("the range ends before it begins", "write [least, most]");
  return range;
}

double number(const Value& value) {
  return value.number();
}

double degrees(const Value& value) {
  return value.degrees();
}

template <class F>
std::string range_to_yaml(const Range& range, F&& text) {
  const auto end = [&](double x) { return std::isfinite(x) ? text(x) : std::string("null"); };
  return "[" + end(range.least) + ", " + end(range.most) + "]";
}

std::string source_to_yaml(const std::string& source) {
  return source.empty() ? "" : "source: " + yaml::write_text(source);
}

}  // namespace

JointBounds read_bounds(const Value& value, const std::vector<AngleAxis>& sequence) {
  value.allow(skeleton_keys::possible);
  JointBounds bounds;
  if (const auto radius = value.find("radius_mm")) bounds.radius_mm = read_range(*radius, number);
  if (const auto axis = value.find("axis_to_shaft_deg")) bounds.axis_to_shaft = read_range(*axis, degrees);
  if (const auto rest = value.find("rest_deg")) {
    for (const auto& [name, range] : rest->pairs()) {
      std::vector<std::string> known;
      for (const AngleAxis& angle : sequence) known.push_back(angle.name);
      if (std::find(known.begin(), known.end(), name) == known.end())
        range.fail_unknown("angle", name, known);
      bounds.rest.emplace_back(name, read_range(range, degrees));
    }
  }
  if (const auto source = value.find("source")) bounds.source = source->text();
  return bounds;
}

std::string bounds_to_yaml(const JointBounds& bounds) {
  std::string out, rest;
  const auto add = [](std::string& to, const std::string& part) {
    if (!part.empty()) to += (to.empty() ? "" : ", ") + part;
  };
  if (!bounds.radius_mm.any()) add(out, "radius_mm: " + range_to_yaml(bounds.radius_mm, yaml::write_number));
  if (!bounds.axis_to_shaft.any())
    add(out, "axis_to_shaft_deg: " + range_to_yaml(bounds.axis_to_shaft, yaml::write_degrees));
  for (const auto& [name, range] : bounds.rest)
    add(rest, yaml::write_text(name) + ": " + range_to_yaml(range, yaml::write_degrees));
  if (!rest.empty()) add(out, "rest_deg: {" + rest + "}");
  add(out, source_to_yaml(bounds.source));
  return "{" + out + "}";
}

BodySize read_size(const Value& value) {
  value.allow(skeleton_keys::size);
  BodySize size;
  size.least = value.at("least").number();
  size.most = value.at("most").number();
  const auto whole = value.find("whole");
  size.whole = whole ? whole->number() : size.least;
  if (const auto source = value.find("source")) size.source = source->text();
  if (!(size.least > 0 && size.least <= size.whole && size.whole <= size.most))
    value.fail("is no range of sizes", "write 0 < least <= whole <= most, in mm");
  return size;
}

std::string size_to_yaml(const BodySize& size) {
  std::string out = "{least: " + yaml::write_number(size.least) +
                    ", whole: " + yaml::write_number(size.whole) + ", most: " + yaml::write_number(size.most);
  if (!size.source.empty()) out += ", " + source_to_yaml(size.source);
  return out + "}";
}

}  // namespace ecorche::io
