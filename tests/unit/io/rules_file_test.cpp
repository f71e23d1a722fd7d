// SPDX-License-Identifier: Apache-2.0
// Rules of joints, regions and skeleton templates as files: they read back, and every mistake is named.
#include <gtest/gtest.h>

#include <ecorche/io/case_file.hpp>
#include "io/case/case_rules.hpp"
#include "io/case/skeleton_file.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::io {
namespace {

PlacedSkeleton parse_rules(const std::string& text) {
  return parse_skeleton(yaml::Value::parse(text, "s.yaml"), Frame{});
}

// A skeleton of two segments whose second joint has these keys.
std::string two(const std::string& joint) {
  return "ecorche_skeleton: 1\nname: a\nsegments:\n  a: {joint: {name: root, center: [0, 0, 0]}}\n  b:\n    "
         "parent: "
         "a\n    joint: {name: hip, " +
         joint + "}\n";
}

TEST(Rules, EverySourceReadsBack) {
  const std::string center =
      "{any: [{sphere_fit: {segment: b, facing_segment: a}}, {between: [{centroid: {region: head}}, {joint: "
      "root}], "
      "at: 0.25}, {cylinder_fit: {bone: f, facing: g, looks: [0, 0, 1]}}, {plane_fit: {bone: f}}, "
      "{ellipse_fit: {segment: b}}, "
      "[1, 2, 3]]}";
  const std::string axes =
      "{z: {from: {joint: root}, to: [0, 0, 5]}, x: {any: [{cylinder_fit: {region: head}, towards: [1, 0, "
      "0]}, "
      "{axis_of: root}, [0, 1, 0]]}}";
  const std::string text = two("center: " + center + ", axes: " + axes + ", rest_deg: measured");
  const PlacedSkeleton placed = parse_rules(text);
  const Joint& joint = placed.skeleton.segments[1].joint;
  ASSERT_TRUE(joint.how);
  EXPECT_TRUE(joint.how->measured_rest);
  EXPECT_EQ(joint.rule, CenterRule::first_good);
  EXPECT_EQ(point_to_yaml(joint.how->center), center.substr(0, center.size()));
  EXPECT_EQ(axes_to_yaml(joint.how->axes), axes);
  EXPECT_EQ(joint.how->axes[0].first, 2);  // the first in the file keeps its direction
  const std::string again = skeleton_to_yaml(placed.skeleton);
  EXPECT_EQ(skeleton_to_yaml(parse_rules(again).skeleton), again);
  EXPECT_EQ(placed.named.bones.size(), 3U);
  EXPECT_EQ(placed.named.regions.size(), 2U);
}

TEST(Rules, WhatIsPossibleReadsBack) {
  const std::string size = "size_mm: {least: 40, whole: 300, most: 3000, source: \"a book\"}";
  const std::string possible =
      "{radius_mm: [15, null], axis_to_shaft_deg: [75, 105], rest_deg: {x: [-35, 130], z: [null, 10]}, "
      "source: \"two books\"}";
  std::string text =
      two("center: {cylinder_fit: {segment: b, facing_segment: a, along: [1, 0, 0]}}, possible: " + possible);
  text.insert(text.find("segments:"), size + "\n");
  const PlacedSkeleton placed = parse_rules(text);
  ASSERT_TRUE(placed.size);
  EXPECT_EQ(placed.size->whole, 300);
  EXPECT_EQ("size_mm: " + size_to_yaml(*placed.size), size);
  const JointRule& rule = *placed.skeleton.segments[1].joint.how;
  EXPECT_EQ(rule.center.on.along, Eigen::Vector3d(1, 0, 0));
  EXPECT_TRUE(rule.possible.radius_mm.holds(1e9));
  EXPECT_FALSE(rule.possible.radius_mm.holds(14.9));
  EXPECT_EQ(bounds_to_yaml(rule.possible), possible);
  const std::string again = skeleton_to_yaml(placed.skeleton, placed.size);
  EXPECT_EQ(skeleton_to_yaml(parse_rules(again).skeleton, parse_rules(again).size), again);
}

TEST(Rules, WhatIsNotPossibleIsRefused) {
  const auto refused = [](const std::string& joint, const std::string& part) {
    expect_error(ErrorKind::config, part, [&] { parse_rules(two("center: [0, 0, 0], possible: " + joint)); });
  };
  refused("{radius_mm: [1]}", "possible.radius_mm: is a range of 1 values (write [least, most])");
  refused("{axis_to_shaft_deg: [9, 8]}", "axis_to_shaft_deg: the range ends before it begins");
  refused("{rest_deg: {bend: [0, 1]}}", "unknown angle 'bend'");
  expect_error(ErrorKind::config, "along: is for vertices that face another segment (name that segment)",
               [] { parse_rules(two("center: {centroid: {segment: b, along: [1, 0, 0]}}")); });
  std::string text = two("center: [0, 0, 0]");
  text.insert(text.find("segments:"), "size_mm: {least: 5, most: 4}\n");
  expect_error(ErrorKind::config, "size_mm: is no range of sizes (write 0 < least <= whole <= most, in mm)",
               [&] { parse_rules(text); });
}

TEST(Rules, AFrameTurnsPointsAndDirections) {
  const Frame ras{(Eigen::Matrix3d() << -1, 0, 0, 0, -1, 0, 0, 0, 1).finished(), 10};
  const Skeleton s =
      parse_skeleton(
          yaml::Value::parse(
              two("center: {between: [[1, 0, 0], [3, 0, 0]]}, axes: {x: {axis_of: root}, z: [1, 0, 1]}"),
              "s"),
          ras)
          .skeleton;
  EXPECT_EQ(s.segments[1].joint.how->center.parts[1].point, Eigen::Vector3d(-30, 0, 0));
  EXPECT_LT(
      (s.segments[1].joint.how->axes[1].second.direction - Eigen::Vector3d(-1, 0, 1).normalized()).norm(),
      1e-15);
}

TEST(Rules, EveryMistakeIsNamed) {
  const auto refused = [](const std::string& joint, const std::string& part) {
    expect_error(ErrorKind::config, part, [&] { parse_rules(two(joint)); });
  };
  refused("center: {sphere_fit: {region: h}, centroid: {region: h}}",
          "center: names both 'sphere_fit' and 'centroid'");
  refused("center: {at: 0.5}", "center: names no source");
  refused("center: {sphere_fit: {region: h}, at: 0.5}", "center.at: belongs to between");
  refused("center: {any: []}", "center.any: is empty (list one source at least)");
  refused("center: {between: [[0, 0, 0]]}", "center.between: has 1 ends (write two)");
  refused("center: {centroid: {region: h, bone: f}}",
          "center.centroid: names 2 places (name one region, bone or segment)");
  refused("center: {centroid: {bone: f, facing_segment: a}}",
          "center.centroid: faces what is of another kind");
  refused("center: {centroid: {segment: b, facing_segment: b}}",
          "center.centroid: a segment cannot face itself");
  refused("center: {centroid: {segment: b, looks: [0, 0, 1]}}",
          "looks: is for vertices that face another bone");
  refused("center: {centroid: {segment: c}}", "center.centroid.segment: unknown segment 'c'");
  refused("center: {joint: hop}", "center.joint: unknown joint 'hop' (did you mean 'hip'?)");
  const std::string center = "center: [0, 0, 0], axes: ";
  refused(center + "{x: {axis_of: root}}", "axes: names 1 axes (name two of x, y, z)");
  refused(center + "{x: {towards: [1, 0, 0]}, z: [0, 0, 1]}", "axes.x: names no direction");
  refused(center + "{x: {sphere_fit: {bone: f}}, z: [0, 0, 1]}",
          "axes.x.sphere_fit: unknown key 'sphere_fit'");
  refused(center + "{x: {any: []}, z: [0, 0, 1]}", "axes.x.any: is empty (list one source at least)");
  refused(center + "{x: {axis_of: root}, z: [0, 0, 0]}", "axes.z: has no length");
  refused(center + "{x: {from: [0, 0, 0]}, z: [0, 0, 1]}", "axes.x: lacks the key 'to'");
}

TEST(Rules, RegionsReadBackAndTheirMistakesAreNamed) {
  const std::string text =
      "ecorche_regions: 1\nregions:\n  head: {bone: f, boxes: [{least: [0, 0, 0], most: [1, 2, 3]}]}\n"
      "  heel: {segment: b, boxes: [{least: [0, 0.8, 0], most: [1, 1, 0.5]}], of: bones}\n"
      "  end: {segment: b, boxes: [{least: [0, 0, 0], most: [1, 1, 0.5]}], near: a, along: [1, 0, 0]}\n"
      "  marks: {bone: f, points: [[1, 2, 3], [4, 5, 6]]}\n";
  const Scratch scratch;
  std::vector<Region> regions;
  for (const PlacedRegion& placed : read_regions_file(scratch.put("regions.yaml", text), Frame{}))
    regions.push_back(placed.region);
  EXPECT_EQ(regions_to_yaml(regions), text);
  EXPECT_TRUE(regions[1].of_bones);
  const auto refused = [&](const std::string& region, const std::string& part) {
    const auto file = scratch.put("bad.yaml", "ecorche_regions: 1\nregions:\n  r: " + region + "\n");
    expect_error(ErrorKind::config, part, [&] { read_regions_file(file, Frame{}); });
  };
  refused("{boxes: []}", "regions.r: is on no one place (name its bone or its segment)");
  refused("{bone: f, segment: a, boxes: []}", "regions.r: is on no one place");
  refused("{bone: f, boxes: []}", "regions.r: holds nothing (list boxes, vertices or points)");
  refused("{bone: f, boxes: [{least: [0, 3, 0], most: [1, 2, 3]}]}", "boxes[0]: its least is above its most");
  refused("{bone: f, of: skin, points: [[1, 2, 3]]}", "regions.r.of: 'skin' holds no boxes");
  refused("{bone: f, vertices: [0.5]}", "must be a whole number, is '0.5' (write a whole number)");
  const std::string box = "boxes: [{least: [0, 0, 0], most: [1, 1, 1]}]";
  refused("{segment: a, of: bones, near: b, " + box + "}", "regions.r.near: says again where boxes lie");
  refused("{segment: a, near: a, " + box + "}", "regions.r.near: is the region's own segment");
  refused("{bone: f, near: a, points: [[1, 2, 3]]}", "regions.r.near: is for boxes");
  refused("{segment: a, along: [1, 0, 0], " + box + "}", "regions.r.along: is for boxes near a segment");
  refused("{segment: a, near: b, along: [0, 0, 0], " + box + "}", "regions.r.along: has no length");
  refused("{segment: a, vertices: [1]}", "regions.r.vertices: count the vertices of a bone");
  const auto file = scratch.put("bad.yaml", "ecorche_regions: 2\nregions: {}\n");
  expect_error(ErrorKind::config, "version '2' is not known", [&] { read_regions_file(file, Frame{}); });
  const auto named = scratch.put("bad.yaml", "ecorche_regions: 1\nregions:\n  R: {bone: f}\n");
  expect_error(ErrorKind::config, "regions.R: 'R' is no identifier",
               [&] { read_regions_file(named, Frame{}); });
}

// The small case with a rule on regions of its own file.
struct CaseWithRegions {
  Scratch scratch;
  CaseWithRegions(const std::string& regions, const std::string& center,
                  const std::string& skeleton = "skeleton.yaml") {
    write_case(scratch.path(), small_case(), {});
    std::ifstream file(scratch / "case.yaml", std::ios::binary);
    std::string text(std::istreambuf_iterator<char>(file), {});
    text.replace(text.find("skeleton.yaml"), 13, skeleton);
    scratch.put("case.yaml", text + "regions: regions.yaml\n");
    scratch.put("regions.yaml", "ecorche_regions: 1\nregions:\n" + regions);
    scratch.put(
        "skeleton.yaml",
        "ecorche_skeleton: 1\nname: small\nsegments:\n  pelvis: {joint: {name: root, center: [0, 0, 0]}}\n"
        "  thigh_right: {parent: pelvis, joint: {name: hip_right, center: " +
            center +
            "}}\n"
            "regions:\n  low: {segment: thigh_right, boxes: [{least: [0, 0, 0], most: [1, 1, 0.5]}], of: "
            "bones}\n"
            "  high: {segment: thigh_right, boxes: [{least: [0, 0, 0], most: [1, 1, 0.5]}], of: bones}\n");
  }
  Case read() const { return read_case(scratch.path(), {}, {}); }
};

TEST(Rules, ACasesRegionsWinAndVerticesBecomePoints) {
  const CaseWithRegions files("  high: {bone: femur_right, vertices: [4, 5]}\n",
                              "{centroid: {region: high}}");
  const Case patient = files.read();
  ASSERT_EQ(patient.regions.size(), 2U);
  EXPECT_EQ(patient.regions[0].name, "high");
  ASSERT_EQ(patient.regions[0].points.rows(), 2);
  EXPECT_EQ(patient.regions[0].points.row(0), patient.bones[1].surface.V.row(4));
  EXPECT_EQ(patient.regions[1].name, "low");
  write_case(files.scratch / "copy", patient, {});
  const Case back = read_case(files.scratch / "copy", {}, {});
  EXPECT_EQ(regions_to_yaml(back.regions), regions_to_yaml(patient.regions));
  EXPECT_EQ(skeleton_to_yaml(back.skeleton), skeleton_to_yaml(patient.skeleton));
}

TEST(Rules, ACasesMistakesAreNamed) {
  const auto refused = [](const std::string& regions, const std::string& center, const std::string& part) {
    const CaseWithRegions files(regions, center);
    expect_error(ErrorKind::config, part, [&] { files.read(); });
  };
  const std::string good = "  head: {bone: femur_right, vertices: [0]}\n";
  refused(good, "{centroid: {region: haed}}",
          "center.centroid.region: unknown region 'haed' (did you mean 'head'?)");
  refused("  head: {bone: femur_left, vertices: [0]}\n", "[0, 0, 0]",
          "regions.head.bone: unknown bone 'femur_left'");
  refused("  head: {segment: thigh_left, points: [[0, 0, 0]]}\n", "[0, 0, 0]",
          "regions.head.segment: unknown segment 'thigh_left'");
  refused("  head: {bone: femur_right, vertices: [8]}\n", "[0, 0, 0]",
          "vertex 8 is none of the 8 of bone 'femur_right'");
  refused("  head: {bone: femur_right, vertices: [-1]}\n", "[0, 0, 0]", "vertex -1 is none of the 8");
  refused(good, "{centroid: {bone: femur}}",
          "center.centroid.bone: unknown bone 'femur' (use pelvis_bone, femur_right)");
}

TEST(Rules, VerticesOfABoneFromLabelsAreNoneYet) {
  const CaseWithRegions files("  head: {bone: femur_right, vertices: [0]}\n", "[0, 0, 0]");
  std::ifstream file(files.scratch / "case.yaml", std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(file), {});
  const std::string old = "file: \"bones/femur_right.stl\"";
  ASSERT_NE(text.find(old), text.npos) << text;
  text.replace(text.find(old), old.size(), "labels: [1]");
  files.scratch.put("case.yaml", text);
  expect_error(ErrorKind::config,
               "bone 'femur_right' is drawn from labels and has no vertices yet (use boxes)",
               [&] { files.read(); });
}

TEST(Templates, EachIsASkeletonThatReadsBack) {
  const std::map<std::string, std::size_t> sizes{{"human", 22}, {"hand", 19}, {"knee", 3}, {"quadruped", 21}};
  for (const auto& [name, size] : sizes) {
    const PlacedSkeleton placed =
        parse_skeleton(yaml::Value::parse(skeleton_template(name).value(), name + ".yaml"), Frame{});
    EXPECT_EQ(placed.skeleton.segments.size(), size) << name;
    EXPECT_EQ(placed.skeleton.name, name);
    EXPECT_TRUE(placed.named.bones.empty()) << name;  // whatever the bones of a segment are called
    const std::string text = skeleton_to_yaml(placed.skeleton);
    EXPECT_EQ(skeleton_to_yaml(parse_rules(text).skeleton), text) << name;
    for (const Segment& segment : placed.skeleton.segments) {
      const bool limited = std::any_of(segment.joint.sequence.begin(), segment.joint.sequence.end(),
                                       [](const AngleAxis& a) { return std::isfinite(a.min); });
      EXPECT_EQ(limited, !segment.joint.limits_source.empty()) << segment.joint.name;
      EXPECT_EQ(limited, segment.joint.kind != JointKind::free) << segment.joint.name;
    }
    Case patient;
    patient.skeleton = placed.skeleton;
    place_regions({}, placed.regions, patient);
    check_named(placed.named, patient);
  }
  EXPECT_FALSE(skeleton_template("horse"));
}

TEST(Templates, GenericTakesItsSegmentsFromTheBones) {
  const CaseWithRegions files("  head: {segment: pelvis, points: [[0, 0, 0]]}\n", "[0, 0, 0]", "generic");
  const Case patient = files.read();
  EXPECT_TRUE(patient.generic);
  ASSERT_EQ(patient.skeleton.segments.size(), 2U);
  EXPECT_EQ(patient.skeleton.segments[1].name, "thigh_right");
  const CaseWithRegions unknown("  head: {segment: pelvis, points: [[0, 0, 0]]}\n", "[0, 0, 0]", "horse");
  expect_error(ErrorKind::config,
               "no skeleton template is named 'horse' (use human, hand, knee, quadruped or generic",
               [&] { unknown.read(); });
}

}  // namespace
}  // namespace ecorche::io
