// SPDX-License-Identifier: Apache-2.0
// Every mistake in a case is told with file, line, key and how to mend it.
#include <gtest/gtest.h>

#include <random>

#include <ecorche/io/case_file.hpp>
#include "io/case/yaml_reader.hpp"
#include "io/image/image_file.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::io {
namespace {

const std::string kCase = R"(name: small
frame: LPS
unit: mm
skeleton: skeleton.yaml
skin: skin.stl
bones:
  - {name: pelvis_bone, file: bones/pelvis_bone.stl, segment: pelvis}
  - {name: femur_right, file: bones/femur_right.stl, segment: thigh_right}
tissues:
  - {name: rectus_femoris, file: tissues/rectus_femoris.stl, group: muscle}
volumes:
  - {name: ct, file: volumes/ct.nrrd, background: -1024}
labels: {file: volumes/labels.nrrd, table: {1: pelvis_bone, 2: femur_right}}
)";

class CaseRefusals : public ::testing::Test {
 protected:
  CaseRefusals() { write_case(scratch_.path(), small_case(), Context{}); }

  Case read(const std::string& text, const CaseOptions& options = {}) {
    return read_case(scratch_.put("case.yaml", text), options, Context{});
  }
  static std::string changed(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, text.npos) << from;
    return at == text.npos ? text : text.replace(at, from.size(), to);
  }
  void refused(const std::string& from, const std::string& to, const std::string& part,
               ErrorKind kind = ErrorKind::config) {
    expect_error(kind, "/case.yaml:" + part, [&] { read(changed(kCase, from, to)); });
  }

  Scratch scratch_;
};

TEST_F(CaseRefusals, TheUnchangedCaseIsRead) {
  EXPECT_EQ(read(kCase).bones.size(), 2u);
}

TEST_F(CaseRefusals, WhatIsSaidOfContacts) {
  const auto with = [](const std::string& contacts) { return kCase + "contacts: " + contacts + "\n"; };
  EXPECT_TRUE(read(kCase).contacts.cut);
  EXPECT_TRUE(read(with("cut")).contacts.cut);
  EXPECT_FALSE(read(with("joined")).contacts.cut);
  const CaseContacts some = read(with("{joined: [[pelvis, thigh_right], [thigh_right, pelvis]]}")).contacts;
  EXPECT_TRUE(some.cut);
  ASSERT_EQ(some.joined.size(), 2U);
  EXPECT_EQ(some.joined[0], (std::pair<std::string, std::string>("pelvis", "thigh_right")));
  Case written = small_case();
  for (const CaseContacts& contacts : {some, CaseContacts{false, {}}, CaseContacts{}}) {
    written.contacts = contacts;
    write_case(scratch_.path(), written, Context{});
    const CaseContacts back = read_case(scratch_.path() / "case.yaml", {}, Context{}).contacts;
    EXPECT_EQ(back.cut, contacts.cut);
    EXPECT_EQ(back.joined, contacts.joined);
  }
  const auto said = [&](const std::string& contacts, const std::string& part) {
    expect_error(ErrorKind::config, "/case.yaml:14:contacts" + part, [&] { read(with(contacts)); });
  };
  said("apart", ": 'apart' says nothing of limbs that touch (use cut (they come apart), joined, or joined: ");
  said("[a, b]", ": must be a plain value, is a list");
  said("{cut: []}", ".cut: unknown key 'cut' (use joined)");
  said("{joined: []}", ".joined: lists no pairs, or more than 1000 (list 1 to 1000)");
  said("{joined: [pelvis]}", ".joined[0]: is no pair (name two segments, such as [hand_left, pelvis])");
  said("{joined: [[pelvis, pelvis, pelvis]]}", ".joined[0]: is no pair");
  said("{joined: [[pelvis, thigh_rigth]]}", ".joined[0][1]: unknown segment 'thigh_rigth'");
}

TEST_F(CaseRefusals, KeysAndTypes) {
  expect_error(ErrorKind::config, "case.yaml: is empty (see docs/reference/case.md)", [&] { read(""); });
  refused("unit: mm", "units: mm", "3:units: unknown key 'units' (did you mean 'unit'?)");
  refused("unit: mm", "atlas: r.yaml",
          "3:atlas: unknown key 'atlas' (use name, frame, unit, skeleton, spine, ribs, skin, bones, regions, "
          "tissues, labels, "
          "volumes, stiffness_kpa, contacts)");
  refused("name: small\n", "", "1: lacks the key 'name' (add it)");
  refused("name: small", "name:", "1:name: must be a plain value, is nothing");
  refused("unit: mm", "unit: [mm]", "3:unit: must be a plain value, is a list");
  refused("unit: mm", "unit: inch",
          "3:unit: 'inch' is no unit (use um, mm, cm, m, in, or a number: millimetres a unit)");
  refused("frame: LPS", "frame: LPL",
          "2:frame: 'LPL' is no frame (use LPS, RAS, or three letters such as LSA");
  refused("frame: LPS", "frame: LPS\nframe: RAS", "3: the key 'frame' stands twice (keep one of them)");
  refused(", segment: thigh_right", "", "8:bones[1]: lacks the key 'segment'");
  refused("segment: thigh_right", "segmnt: thigh_right",
          "8:bones[1].segmnt: unknown key 'segmnt' (did you mean 'segment'?)");
  refused("-1024", "low", "12:volumes[0].background: must be a number, is 'low' (write a finite number)");
  refused("-1024", ".nan", "12:volumes[0].background: must be a number, is '.nan'");
  refused("-1024", "1e999", "12:volumes[0].background: must be a number, is '1e999'");
  refused("bones:\n", "bones: []\nx:\n", "7:x: unknown key 'x'");
  const std::string none =
      changed(changed(kCase, "  - {name: pelvis_bone, file: bones/pelvis_bone.stl, segment: pelvis}\n", ""),
              "  - {name: femur_right, file: bones/femur_right.stl, segment: thigh_right}\n", "");
  expect_error(ErrorKind::config, "6:bones: must be a list, is nothing", [&] { read(none); });
  expect_error(ErrorKind::config, "6:bones: is empty (list at least one bone)",
               [&] { read(changed(none, "bones:", "bones: []")); });
}

TEST_F(CaseRefusals, Names) {
  refused("name: femur_right", "name: pelvis_bone", "8:bones[1].name: 'pelvis_bone' is named already, at");
  refused("name: rectus_femoris", "name: skin", "10:tissues[0].name: 'skin' is named already, at");
  refused("name: femur_right", "name: Femur",
          "8:bones[1].name: 'Femur' is no identifier (use 1 to 64 of a-z, 0-9 and _)");
  refused("name: femur_right", "name: " + std::string(65, 'a'), "8:bones[1].name: 'aaaa");
  refused("name: ct", "name: labels", "12:volumes[0].name: 'labels' is the label map's name");
  refused("name: ct", "name: labels_2", "12:volumes[0].name: 'labels_2' is the label map's name");
  refused("segment: thigh_right", "segment: thigh_rigth",
          "8:bones[1].segment: unknown segment 'thigh_rigth' (did you mean 'thigh_right'?)");
  refused("segment: thigh_right", "segment: head",
          "8:bones[1].segment: unknown segment 'head' (use pelvis, thigh_right)");
  refused("group: muscle", "group: muscel",
          "10:tissues[0].group: unknown group 'muscel' (did you mean 'muscle'?)");
  refused("volumes:\n  - {name: ct, file: volumes/ct.nrrd, background: -1024}\n", "volumes: none\n",
          "11:volumes: must be a list, is 'none' (write it as");
  refused("group: muscle", "group: muscles",
          "10:tissues[0].group: unknown group 'muscles' (did you mean 'muscle'?)");
  refused("group: muscle", "group: bone",
          "10:tissues[0].group: 'bone' is no group of tissues (list it under skin or bones)");
  refused("{1:", "{one:", "13:labels.table.one: 'one' is no label id");
  refused("{1:", "{0:", "13:labels.table.0: label 0 is nothing");
  refused(" 2:", " 01:", "13:labels.table.01: label 01 stands twice");
  Image field(small_case().labels->image.grid, ScalarType::f32);
  field.scalars<float>()[1] = 0.25F;
  write_image(scratch_ / "volumes" / "field.nrrd", field);
  expect_error(ErrorKind::data, "labels are no whole numbers, the first 0.25 at voxel (1, 0, 0)",
               [&] { read(changed(kCase, "labels.nrrd", "field.nrrd")); });
}

TEST_F(CaseRefusals, Stiffness) {
  const std::string soft = changed(kCase, "unit: mm", "unit: mm\nstiffness_kpa: 5.5");
  EXPECT_EQ(read(soft).stiffness_kpa, 5.5);
  EXPECT_FALSE(read(soft).tissues[0].stiffness_kpa);
  const Case both = read(changed(soft, "group: muscle", "group: muscle, stiffness_kpa: 12e1"));
  EXPECT_EQ(both.tissues[0].stiffness_kpa, 120);
  // And back.
  const Scratch again;
  write_case(again.path(), both, Context{});
  const Case back = read_case(again.path(), {}, Context{});
  EXPECT_EQ(back.stiffness_kpa, 5.5);
  EXPECT_EQ(back.tissues[0].stiffness_kpa, 120);
  refused("group: muscle", "group: muscle, stiffness_kpa: 12",
          "10:tissues[0].stiffness_kpa: the flesh about this tissue has none (give the case a stiffness_kpa, "
          "too: of flesh in no tissue that says its own)");
  for (const char* bad : {"0", "-3", "0.009", "1000001", "1e300"})
    refused("unit: mm", std::string("unit: mm\nstiffness_kpa: ") + bad,
            std::string("4:stiffness_kpa: ") + bad +
                " is out of range (give Young's modulus in kPa, 0.01 to 1000000: fat has a few, muscle some "
                "tens)");
  refused("unit: mm", "unit: mm\nstiffness_kpa: soft", "4:stiffness_kpa: must be a number, is 'soft'");
  refused("segment: pelvis}", "segment: pelvis, stiffness_kpa: 5}",
          "7:bones[0].stiffness_kpa: unknown key 'stiffness_kpa'");
}

TEST_F(CaseRefusals, Files) {
  refused("bones/femur_right.stl", "bones/femur.stl",
          "8:bones[1].file: no such file: ", ErrorKind::missing_input);
  refused("skin.stl", "skn.stl", "5:skin: no such file: ", ErrorKind::missing_input);
  refused("skeleton.yaml", "horse",
          "4:skeleton: no skeleton template is named 'horse' (use human, hand, knee, quadruped or generic, "
          "or name a .yaml "
          "file beside the case)");
  refused("file: volumes/ct.nrrd", "file: volumes/ct.nrrd, root: data",
          "12:volumes[0].root: the data folder is not known (name it with --data DIR)");
  refused("file: volumes/ct.nrrd", "file: volumes/ct.nrrd, root: home",
          "12:volumes[0].root: 'home' is no root");
  scratch_.put("bones/femur_right.stl", "solid\n");
  expect_error(ErrorKind::data, "femur_right.stl:2: expected 'facet' or 'endsolid', the file ends",
               [&] { read(kCase); });
  expect_error(ErrorKind::missing_input, "none/case.yaml",
               [&] { read_case(scratch_ / "none" / "case.yaml", {}, Context{}); });
  std::filesystem::create_directories(scratch_ / "empty");
  expect_error(ErrorKind::missing_input, "empty/case.yaml",
               [&] { read_case(scratch_ / "empty", {}, Context{}); });
}

TEST_F(CaseRefusals, RootDataIsTheDataFolder) {
  std::filesystem::create_directories(scratch_ / "data");
  std::filesystem::rename(scratch_ / "skin.stl", scratch_ / "data" / "skin.stl");
  CaseOptions options;
  options.data = scratch_ / "data";
  const Case patient = read(changed(kCase, "skin: skin.stl", "skin: {file: skin.stl, root: data}"), options);
  EXPECT_EQ(patient.skin.V, small_case().skin.V);
}

TEST_F(CaseRefusals, NotYaml) {
  refused("unit: mm", "unit: [mm, {", "7: is no YAML: illegal block entry (mend the line)");
  refused("unit: mm", "unit: \"mm" + std::string(5000, 'x'), "3:unit: 'mmxxx");
  refused("unit: mm", "unit: &a mm", "3: an anchor (&name) (write the value out)");
  refused("unit: mm", "unit: !!str mm", "3: a tag (tag:yaml.org,2002:str) (leave it out)");
  expect_error(ErrorKind::config, "case.yaml: is empty", [&] { read(""); });
  expect_error(ErrorKind::config, "case.yaml: holds more than one document",
               [&] { read(kCase + "---\na: b\n"); });
  expect_error(ErrorKind::config, "case.yaml:1: must be a map, is a list", [&] { read("[a]"); });
  // The bomb of nine lines whose aliases expand to billions of nodes.
  expect_error(ErrorKind::config, "an anchor", [&] { read("a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n"); });
  expect_error(ErrorKind::config, "nested deeper than 64",
               [&] { read("a: " + std::string(100, '[') + std::string(100, ']')); });
  expect_error(ErrorKind::config, "case.yaml:1", [&] { read(std::string(200000, '[')); });
  expect_error(ErrorKind::config, "case.yaml:1", [&] { read(std::string(200000, '{')); });
  expect_error(ErrorKind::data, "longer than 16777216 bytes",
               [&] { read(std::string((16 << 20) + 1, '#')); });
  std::string many = "a: [";
  for (int i = 0; i < 1000001; ++i) many += "1,";
  expect_error(ErrorKind::config, "more than a million values", [&] { read(many + "]"); });
}

TEST_F(CaseRefusals, EveryPrefixAndFlipOfACaseFailsCleanly) {
  // Up to the tissues a prefix lacks something that is needed.
  const std::size_t needed = kCase.find("  - {name: pelvis_bone");
  for (std::size_t n = 0; n < needed; n += 3) EXPECT_THROW(read(kCase.substr(0, n)), Error) << n;
  std::mt19937 random(4);
  for (int round = 0; round < 2000; ++round) {
    std::string text = kCase;
    for (int flips = 0; flips < 1 + round % 3; ++flips)
      text[random() % text.size()] = static_cast<char>(random());
    try {
      yaml::Value::parse(text, "case.yaml");
    } catch (const Error& error) {
      ASSERT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::config)) << error.what();
    }
  }
}

}  // namespace
}  // namespace ecorche::io
