// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include <ecorche/io/case_file.hpp>
#include "io/case/skeleton_file.hpp"
#include "io/case/yaml_text.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::io {
namespace {

Skeleton parse(const std::string& text) {
  return parse_skeleton(yaml::Value::parse(text, "s.yaml"), Frame{}).skeleton;
}

std::string segments(const std::string& text) {
  return "ecorche_skeleton: 1\nname: a\nsegments:\n" + text;
}

void expect_same(const Skeleton& a, const Skeleton& b) {
  ASSERT_EQ(a.segments.size(), b.segments.size());
  for (std::size_t i = 0; i < a.segments.size(); ++i) {
    const Segment &s = a.segments[i], &t = b.segments[i];
    EXPECT_EQ(s.name, t.name);
    EXPECT_EQ(s.parent, t.parent);
    EXPECT_EQ(s.aliases, t.aliases);
    EXPECT_EQ(s.boneless, t.boneless);
    EXPECT_EQ(s.joint.name, t.joint.name);
    EXPECT_EQ(s.joint.kind, t.joint.kind);
    EXPECT_EQ(s.joint.rule, t.joint.rule);
    EXPECT_EQ(s.joint.center, t.joint.center);
    EXPECT_EQ(s.joint.axes, t.joint.axes);
    EXPECT_EQ(s.joint.limits_source, t.joint.limits_source);
    ASSERT_EQ(s.joint.sequence.size(), t.joint.sequence.size());
    for (std::size_t k = 0; k < s.joint.sequence.size(); ++k) {
      const AngleAxis &x = s.joint.sequence[k], &y = t.joint.sequence[k];
      EXPECT_EQ(x.name, y.name);
      EXPECT_EQ(x.axis, y.axis);
      EXPECT_EQ(x.sign, y.sign);
      EXPECT_EQ(x.rest, y.rest);
      EXPECT_EQ(x.min, y.min);
      EXPECT_EQ(x.max, y.max);
    }
    ASSERT_EQ(s.joint.coupled.size(), t.joint.coupled.size());
    for (std::size_t k = 0; k < s.joint.coupled.size(); ++k)
      EXPECT_EQ(s.joint.coupled[k].ratio, t.joint.coupled[k].ratio);
  }
}

TEST(Skeleton, ReadsBackExactly) {
  Skeleton skeleton = small_skeleton();
  // A reader fills in the default sequence.
  skeleton.segments[0].joint.sequence = {
      {.name = "x", .axis = 0}, {.name = "y", .axis = 1}, {.name = "z", .axis = 2}};
  expect_same(parse(skeleton_to_yaml(skeleton)), skeleton);
}

TEST(Skeleton, EveryRadianReadsBackExactly) {
  std::mt19937_64 random(9);
  for (int i = 0; i < 5000; ++i) {
    const double radians = (static_cast<double>(random()) * 0x1p-64 - 0.5) * 2 * std::numbers::pi;
    const std::string text = yaml::write_degrees(radians);
    ASSERT_EQ(yaml::Value::parse(text, "a").degrees(), radians) << text;
  }
  EXPECT_EQ(yaml::write_degrees(yaml::Value::parse("120", "a").degrees()), "120");
}

TEST(Skeleton, AnyTextReadsBack) {
  std::mt19937 random(9);
  for (int i = 0; i < 300; ++i) {
    std::string text(1 + random() % 8, ' ');
    for (char& c : text) c = static_cast<char>(1 + random() % 127);
    EXPECT_EQ(yaml::Value::parse(yaml::write_text(text), "a").text(), text);
  }
  EXPECT_EQ(yaml::Value::parse(yaml::write_text("Fémur: \xe2\x98\x83 #1"), "a").text(),
            "Fémur: \xe2\x98\x83 #1");
  EXPECT_EQ(yaml::write_text("null"), "\"null\"");
  EXPECT_EQ(yaml::write_text("12"), "\"12\"");
}

TEST(Skeleton, ParentsComeFirstWhateverTheFileSays) {
  const Skeleton s =
      parse(segments("  foot: {parent: leg, joint: {name: ankle, center: [0, 0, 0]}}\n"
                     "  leg: {parent: body, joint: {name: hip, center: [0, 0, 0]}}\n"
                     "  body: {joint: {name: root, center: [0, 0, 0]}}\n"
                     "  arm: {parent: body, joint: {name: shoulder, center: [0, 0, 0]}}\n"));
  ASSERT_EQ(s.segments.size(), 4u);
  EXPECT_EQ(s.segments[0].name, "body");
  for (std::size_t i = 1; i < 4; ++i) EXPECT_LT(s.segments[i].parent, static_cast<int>(i));
  EXPECT_EQ(s.segments[static_cast<std::size_t>(
                           s.segments[static_cast<std::size_t>(s.find_segment("foot"))].parent)]
                .name,
            "leg");
}

TEST(Skeleton, TwoAxesSuffice) {
  const auto axes = [](const std::string& text) {
    return parse(segments("  a: {joint: {name: b, center: [0, 0, 0], axes: " + text + "}}\n"))
        .segments[0]
        .joint.axes;
  };
  EXPECT_TRUE(axes("{x: [2, 0, 0], y: [1, 1, 0]}").isIdentity(1e-15));
  EXPECT_TRUE(axes("{y: [0, 1, 0], z: [0, 1, 5]}").isIdentity(1e-15));
  EXPECT_TRUE(axes("{x: [1, 0, 0], z: [0, 0, 1]}").isIdentity(1e-15));
  EXPECT_TRUE(axes("{x: [1, 0, 0], y: [0.01, 1, 0], z: [0, 0.02, 1]}").isIdentity(1e-15));
  for (const char* text :
       {"{x: [1, 2, 3], y: [0, 1, 7]}", "{x: [1, 2, 3], z: [0, 1, 7]}", "{y: [1, 2, 3], z: [0, 1, 7]}"}) {
    const Eigen::Matrix3d m = axes(text);
    EXPECT_TRUE((m.transpose() * m).isIdentity(1e-14)) << text;
    EXPECT_NEAR(m.determinant(), 1, 1e-14) << text;
  }
}

TEST(Skeleton, ASequenceMayNameFewerTurns) {
  const Joint joint =
      parse(segments("  a: {joint: {name: b, kind: hinge, center: [0, 0, 0], sequence: [{flexion: -y}]}}\n"))
          .segments[0]
          .joint;
  ASSERT_EQ(joint.sequence.size(), 3u);
  EXPECT_EQ(joint.sequence[0].axis, 1);
  EXPECT_EQ(joint.sequence[0].sign, -1);
  EXPECT_EQ(joint.sequence[1].name, "x");
  EXPECT_EQ(joint.sequence[2].axis, 2);
}

TEST(Skeleton, EveryMistakeIsNamed) {
  const auto refused = [](const std::string& text, const std::string& part) {
    expect_error(ErrorKind::config, part, [&] { parse(text); });
  };
  const auto joint = [&](const std::string& keys, const std::string& part) {
    refused(
        segments("  a: {joint: {name: root, center: [0, 0, 0]}}\n  b:\n    parent: a\n    joint: {name: hip" +
                 keys + "}\n"),
        part);
  };
  const std::string center = ", center: [0, 0, 0]";
  refused("ecorche_skeleton: 2\nname: a\nsegments: {}\n",
          "s.yaml:1:ecorche_skeleton: version '2' is not known");
  refused("ecorche_skeleton: 1\nname: a\nsegments: {}\n", "s.yaml:3:segments: is empty");
  std::string many;
  for (int i = 0; i < 4097; ++i) many += "  s" + std::to_string(i) + ": {}\n";
  refused(segments(many), "segments: has 4097 segments (4096 are the most)");
  refused(
      segments("  a: {joint: {name: b, center: [0, 0, 0], sequence: [{a: x}, {b: y}, {c: z}, {d: x}]}}\n"),
      "sequence: has 4 turns (write one to three)");
  refused(segments("  a: {joint: {name: b, center: [0, 0, 0], sequence: [{flexion: x}]}}\n  c: {parent: a, "
                   "joint: {name: d, "
                   "center: [0, 0, 0], sequence: [{flexion: x}], coupled: [{joint: b, angle: flexion, "
                   "drives: flecion, ratio: 1}]}}\n"),
          "drives: unknown angle 'flecion' (did you mean 'flexion'?)");
  refused("ecorche_skeleton: 1\nname: a\nsegment: {}\n",
          "s.yaml:3:segment: unknown key 'segment' (did you mean 'segments'?)");
  refused(
      segments("  a: {joint: {name: b, center: [0, 0, 0]}}\n  c: {joint: {name: d, center: [0, 0, 0]}}\n"),
      "s.yaml:5:segments.c: 'c' has no parent, but 'a' is the root already (give it a parent)");
  refused(segments("  a: {parent: b, joint: {name: b, center: [0, 0, 0]}}\n  b: {parent: a, joint: {name: d, "
                   "center: [0, 0, 0]}}\n"),
          "s.yaml:3:segments: every segment has a parent");
  refused(segments("  r: {joint: {name: r, center: [0, 0, 0]}}\n  a: {parent: b, joint: {name: b, center: "
                   "[0, 0, 0]}}\n"
                   "  b: {parent: a, joint: {name: d, center: [0, 0, 0]}}\n"),
          "s.yaml:5:segments.a.parent: 'a' is among its own ancestors");
  refused(segments("  pelvis: {joint: {name: b, center: [0, 0, 0]}}\n  b: {parent: plevis, joint: {name: d, "
                   "center: [0, 0, 0]}}\n"),
          "s.yaml:5:segments.b.parent: unknown segment 'plevis' (did you mean 'pelvis'?)");
  refused(segments("  a: {joint: {name: b, center: [0, 0, 0]}, bones: some}\n"),
          "s.yaml:4:segments.a.bones: 'some' is not known (write bones: none, or leave it out)");
  refused(segments("  A: {joint: {name: b, center: [0, 0, 0]}}\n"),
          "s.yaml:4:segments.A: 'A' is no identifier");
  refused(segments("  a: {joint: {name: hip, center: [0, 0, 0]}}\n  b: {parent: a, joint: {name: hip, "
                   "center: [0, 0, 0]}}\n"),
          "s.yaml:5:segments.b.joint.name: another joint is named 'hip'");
  joint("", "s.yaml:7:segments.b.joint: lacks the key 'center'");
  joint(", center: [0, 0]", "s.yaml:7:segments.b.joint.center: has 2 values (write 3 numbers)");
  joint(", center: [0, 0, .inf]", "s.yaml:7:segments.b.joint.center[2]: must be a number, is '.inf'");
  joint(", center: {sphere: 1}", "segments.b.joint.center.sphere: unknown key 'sphere'");
  joint(", center: {sphere_fit: {bone: f, facing: f}}", "center.sphere_fit: a bone cannot face itself");
  joint(center + ", kind: bal",
        "s.yaml:7:segments.b.joint.kind: unknown kind of joint 'bal' (did you mean 'ball'?)");
  joint(center + ", axes: {x: [1, 0, 0]}",
        "s.yaml:7:segments.b.joint.axes: names 1 axes (name two of x, y, z)");
  joint(center + ", axes: {x: [1, 0, 0], y: [2, 0.1, 0]}", "segments.b.joint.axes: the axes are collinear");
  joint(center + ", axes: {x: [0, 0, 0], y: [0, 1, 0]}", "segments.b.joint.axes.x: has no length");
  joint(center + ", axes: {x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, -1]}",
        "the axes are left-handed in the patient");
  joint(center + ", axes: {x: [1, 0, 0], y: [0, 1, 0], z: [0, 1, 1]}", "the axes are far from right angles");
  joint(center + ", sequence: [{flexion: w}]",
        "segments.b.joint.sequence[0].flexion: 'w' is no axis (use x, y, z, or -x, -y, -z)");
  joint(center + ", sequence: [{flexion: x}, {rotation: -x}]",
        "segments.b.joint.sequence[1]: turns about the same axis again");
  joint(center + ", sequence: [{source: x}]", "'source' cannot name an angle");
  joint(center + ", sequence: [{a: x}, {a: y}]", "the angle 'a' stands twice");
  joint(center + ", sequence: [{y: x}]", "the angle 'y' is named like another axis");
  joint(center + ", sequence: [{a: x, b: y}]",
        "segments.b.joint.sequence[0]: names 2 angles (write one, as {flexion: x})");
  joint(center + ", sequence: []", "segments.b.joint.sequence: has 0 turns");
  joint(center + ", rest_deg: {flexion: 3}",
        "segments.b.joint.rest_deg.flexion: unknown angle 'flexion' (use x, y, z)");
  joint(center + ", limits_deg: {x: [20, 10]}",
        "segments.b.joint.limits_deg.x: the least angle is above the most");
  joint(center + ", limits_deg: {x: [20]}",
        "segments.b.joint.limits_deg.x: has 1 values (write [least, most] in degrees)");
  joint(center + ", limits_deg: {x: [20, 30]}",
        "segments.b.joint: the rest angle of 'x', 0 degrees, is outside its limits");
  joint(center + ", coupled: [{joint: hip, angle: x, drives: x, ratio: 1}]",
        "coupled[0].joint: a joint cannot lead itself");
  joint(center + ", coupled: [{joint: rot, angle: x, drives: x, ratio: 1}]",
        "coupled[0].joint: unknown joint 'rot' (did you mean 'root'?)");
  joint(center + ", coupled: [{joint: root, angle: w, drives: x, ratio: 1}]",
        "coupled[0].angle: unknown angle 'w'");
  joint(center + ", coupled: [{joint: root, angle: x, drives: x}]", "coupled[0]: lacks the key 'ratio'");
  refused(
      segments(
          "  a: {joint: {name: c, center: [0, 0, 0], coupled: [{joint: d, angle: x, drives: x, ratio: 1}]}}\n"
          "  b: {parent: a, joint: {name: d, center: [0, 0, 0], coupled: [{joint: c, angle: x, drives: x, "
          "ratio: 1}]}}\n"),
      "leads itself in a circle");
  expect_error(ErrorKind::missing_input, "none.yaml", [] { read_skeleton("none.yaml"); });
}

TEST(Skeleton, EveryPrefixIsRefusedOrWhole) {
  const std::string whole = skeleton_to_yaml(small_skeleton());
  int read = 0;
  for (std::size_t n = 0; n < whole.size(); ++n) {
    try {
      read += !parse(whole.substr(0, n)).segments.empty();
    } catch (const Error& error) {
      ASSERT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::config)) << error.what();
    }
  }
  EXPECT_GT(read, 0);  // a block of YAML may end at any line
}

// The schema and the reader list the same keys.
TEST(Skeleton, TheSchemaListsTheReadersKeys) {
  std::ifstream file(ECORCHE_SOURCE "/docs/reference/skeleton.schema.json");
  const nlohmann::json schema = nlohmann::json::parse(file);
  const auto same = [](const nlohmann::json& object, std::span<const std::string_view> keys) {
    std::vector<std::string> listed, known(keys.begin(), keys.end());
    for (const auto& [key, value] : object.at("properties").items()) listed.push_back(key);
    std::sort(known.begin(), known.end());
    EXPECT_EQ(listed, known);
    EXPECT_EQ(object.at("additionalProperties"), false);
  };
  const nlohmann::json& parts = schema.at("$defs");
  same(schema, skeleton_keys::file);
  same(parts.at("segment"), skeleton_keys::segment);
  same(parts.at("joint"), skeleton_keys::joint);
  same(parts.at("center"), skeleton_keys::center);
  same(parts.at("use"), skeleton_keys::use);
  same(parts.at("direction"), skeleton_keys::direction);
  same(parts.at("region"), skeleton_keys::region);
  same(parts.at("axes"), skeleton_keys::axes);
  same(schema.at("properties").at("size_mm"), skeleton_keys::size);
  same(parts.at("joint").at("properties").at("possible"), skeleton_keys::possible);
  same(parts.at("coupling"), skeleton_keys::coupling);
  EXPECT_EQ(
      parts.at("joint").at("properties").at("kind").at("enum"),
      nlohmann::json(std::vector<std::string>(skeleton_keys::kinds.begin(), skeleton_keys::kinds.end())));
}

}  // namespace
}  // namespace ecorche::io
