// SPDX-License-Identifier: Apache-2.0
// Cases whose surfaces come from labels: what is read, and every refusal with its place.
#include <gtest/gtest.h>

#include <ecorche/io/case_file.hpp>
#include "io/case/digest.hpp"
#include "io/image/image_file.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::io {
namespace {

const std::string kCase = R"(name: labelled
skeleton: skeleton.yaml
skin: {labels: all, close_mm: 2.5}
bones:
  - {name: pelvis_bone, labels: [Pelvis, 2], segment: pelvis}
  - {name: femur_right, labels: [3], side: right, segment: thigh_right}
  - {name: femur_left, labels: 3, side: left, within: {file: regions.nrrd, ids: [1]}, segment: thigh_right}
tissues:
  - {name: liver, labels: [Liver], group: organ}
  - {labels: rest, group: fat, groups: {muscle: ["Muscle, leg"], vessel: [6, 9]}}
labels:
  file: seg.nrrd
  table: {1: Pelvis, 3: Femora, 4: Liver, 5: "Muscle, leg", 6: Vessels, 7: Vessels, 8: liver, 9: absent}
)";

TEST(Digest, ADiskThatFailsIsNamed) {
  expect_error(ErrorKind::io, "/proc/self/mem: reading failed (check the disk)",
               [] { file_digest("/proc/self/mem", {}); });
  expect_error(ErrorKind::missing_input, "none.raw: cannot be opened (check the path and its rights)",
               [] { file_digest("none.raw", {}); });
}

class LabelCase : public ::testing::Test {
 protected:
  LabelCase() {
    scratch_.put("skeleton.yaml", skeleton_to_yaml(small_skeleton()));
    ImageGrid grid;
    grid.size = {20, 10, 9};
    grid.origin = {-19, 0, 0};
    grid.spacing = {2, 2, 2};
    Image seg(grid, ScalarType::u8), regions(grid, ScalarType::u16);
    for (int k = 0; k < 9; ++k) {
      for (int j = 0; j < 10; ++j) {
        for (int i = 0; i < 20; ++i) {
          seg.scalars<std::uint8_t>()[grid.offset(i, j, k)] = static_cast<std::uint8_t>(j < 8 ? k : 0);
          regions.scalars<std::uint16_t>()[grid.offset(i, j, k)] =
              static_cast<std::uint16_t>(j < 4 ? 1 : 700);
        }
      }
    }
    write_image(scratch_ / "seg.nrrd", seg);
    write_image(scratch_ / "regions.nrrd", regions);
    Image field(grid, ScalarType::u8, 2);
    write_image(scratch_ / "field.nrrd", field);
    grid.spacing[1] = 2.1;
    write_image(scratch_ / "other.nrrd", Image(grid, ScalarType::u8));
  }

  Case read(const std::string& text) { return read_case(scratch_.put("case.yaml", text), {}, Context{}); }
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

TEST_F(LabelCase, IsRead) {
  const Case patient = read(kCase);
  ASSERT_TRUE(patient.skin_source);
  EXPECT_TRUE(patient.skin_source->ids.empty());
  EXPECT_EQ(patient.skin_source->close_mm, 2.5);
  ASSERT_EQ(patient.bones.size(), 3u);
  EXPECT_EQ(patient.bones[0].source->ids, (std::vector<std::int64_t>{1, 2}));
  EXPECT_EQ(patient.bones[1].source->side, Side::right);
  EXPECT_NEAR(patient.bones[1].source->plane_mm, 0, 1e-12);  // the middle of all that is labelled
  EXPECT_EQ(patient.bones[2].source->within_ids, (std::vector<std::int64_t>{1}));
  EXPECT_NE(patient.bones[2].source->where.find("case.yaml:7:bones[2]"), std::string::npos);
  std::vector<std::string> tissues;
  for (const CaseTissue& t : patient.tissues) tissues.push_back(t.name);
  EXPECT_EQ(tissues, (std::vector<std::string>{"liver", "muscle_leg", "vessels", "liver_8"}));
  EXPECT_EQ(patient.tissues[2].source->ids, (std::vector<std::int64_t>{6, 7}));
  EXPECT_EQ(group_name(patient.tissues[0].group), "organ");
  EXPECT_EQ(group_name(patient.tissues[1].group), "muscle");
  EXPECT_EQ(group_name(patient.tissues[2].group), "vessel");
  EXPECT_EQ(group_name(patient.tissues[3].group), "fat");
  EXPECT_TRUE(patient.input_digests.contains("regions.nrrd"));
}

TEST_F(LabelCase, TheRestMaySayItsStiffness) {
  const std::string soft = changed(kCase, "name: labelled", "name: labelled\nstiffness_kpa: 4");
  const auto kpa = [&](const std::string& words) {
    std::vector<double> out;
    for (const CaseTissue& t : read(changed(soft, "{labels: rest,", "{labels: rest, " + words + ",")).tissues)
      out.push_back(t.stiffness_kpa.value_or(0));
    return out;  // liver, muscle_leg, vessels, liver_8
  };
  EXPECT_EQ(kpa("stiffness_kpa: 9"), (std::vector<double>{0, 9, 9, 9}));
  EXPECT_EQ(kpa("stiffness_kpa: {muscle: 20, fat: 2}"), (std::vector<double>{0, 20, 0, 2}));
  refused("{labels: rest,", "{labels: rest, stiffness_kpa: {muscle: 20},",
          "10:tissues[1].stiffness_kpa: the flesh about this tissue has none");
  refused("{labels: rest,", "{labels: rest, stiffness_kpa: {muscle: 0},",
          "10:tissues[1].stiffness_kpa.muscle: 0 is out of range");
  refused("{labels: rest,", "{labels: rest, stiffness_kpa: {musle: 3},",
          "10:tissues[1].stiffness_kpa.musle: unknown group 'musle' (did you mean 'muscle'?)");
  refused("{labels: rest,", "{labels: rest, stiffness_kpa: {nerve: 3},",
          "10:tissues[1].stiffness_kpa.nerve: unknown group 'nerve' (use muscle, vessel, fat; no tissue of "
          "this entry is of it)");
}

TEST_F(LabelCase, TheRestMayLeaveLabelsOut) {
  const Case patient = read(changed(kCase, "{labels: rest,", "{labels: rest, except: [Vessels, 8, 9],"));
  ASSERT_EQ(patient.tissues.size(), 2u);
  EXPECT_EQ(patient.tissues[1].name, "muscle_leg");
  refused("{labels: rest,", "{labels: rest, except: [Vesels],",
          "10:tissues[1].except[0]: unknown label 'Vesels' (did you mean 'Vessels'?)");
  // However it is written: names out of a table's file are small letters.
  EXPECT_EQ(read(changed(kCase, "{labels: rest,", "{labels: rest, except: [vesSELS, 8, 9],")).tissues.size(),
            2u);
  EXPECT_EQ(read(changed(kCase, "{labels: rest,", "{labels: rest, except: [MUSCLE_leg],")).tissues.size(),
            3u);
}

// Names out of a table's file become identifiers; the case may name them as they stand there.
TEST_F(LabelCase, NamesMayBeThoseOfTheTablesFile) {
  scratch_.put("t.ctbl", "1 vertebrae_S1 0 0 0 0\n2 Femur-left 0 0 0 0\n3 femur_left 0 0 0 0\n");
  const std::string text =
      "name: a\nskeleton: skeleton.yaml\nlabels: {file: seg.nrrd, table: t.ctbl}\nbones:\n"
      "  - {name: sacrum, labels: [vertebrae_S1], segment: pelvis}\n"
      "  - {name: femur, labels: [femur_left], segment: thigh_right}\n";
  EXPECT_EQ(read(text).bones[0].source->ids, std::vector<std::int64_t>{1});
  EXPECT_EQ(read(text).bones[1].source->ids, std::vector<std::int64_t>{2});
  EXPECT_EQ(read(changed(text, "[femur_left]", "[Femur-left]")).bones[1].source->ids,
            std::vector<std::int64_t>{2});
  expect_error(ErrorKind::config,
               "5:bones[0].labels[0]: unknown label 'vertebrae_S2' (did you mean 'vertebrae_s1'?)",
               [&] { read(changed(text, "vertebrae_S1", "vertebrae_S2")); });
  // Two names of a map written by hand that differ only so stay two.
  const std::string inlined = changed(text, "table: t.ctbl", "table: {1: A b, 2: a-b}");
  EXPECT_EQ(read(changed(changed(inlined, "vertebrae_S1", "A b"), "femur_left", "a-b")).bones[1].source->ids,
            std::vector<std::int64_t>{2});
  expect_error(ErrorKind::config, "unknown label 'a_b'",
               [&] { read(changed(changed(inlined, "vertebrae_S1", "a_b"), "femur_left", "a-b")); });
}

TEST_F(LabelCase, AFolderOfDicomIsAnImage) {
  scratch_.put("ct/IM0001", std::string(128, '\0') + "DICM");
  const auto volume = [](const std::string& more) {
    return kCase + "volumes:\n  - {name: ct, file: ct" + more + "}\n";
  };
  expect_error(ErrorKind::data, "/ct/IM0001: does not tell its transfer syntax", [&] { read(volume("")); });
  expect_error(ErrorKind::config, "phase: is no phase (phases are counted from 1)",
               [&] { read(volume(", phase: 0")); });
  scratch_.put("notes/a.txt", "x");
  expect_error(ErrorKind::missing_input, "no such file",
               [&] { read(changed(volume(""), "file: ct", "file: notes")); });
}

TEST_F(LabelCase, BecomesSurfaces) {
  Case patient = read(kCase);
  label_surfaces::resolve(patient, Context{});
  const auto low = [](const SurfaceMesh& mesh) { return mesh.V.colwise().minCoeff().eval(); };
  const auto high = [](const SurfaceMesh& mesh) { return mesh.V.colwise().maxCoeff().eval(); };
  EXPECT_NEAR(low(patient.skin)[0], -20, 1);
  EXPECT_NEAR(high(patient.skin)[2], 17, 1);
  EXPECT_LT(high(patient.bones[1].surface)[0], 1);
  EXPECT_GT(low(patient.bones[2].surface)[0], -1);
  EXPECT_LT(high(patient.bones[2].surface)[1], 8);  // within the region alone
  EXPECT_GT(high(patient.bones[1].surface)[1], 13);
}

TEST_F(LabelCase, ASkinLeftOutIsTheOutsideOfEverything) {
  const Case patient = read(changed(kCase, "skin: {labels: all, close_mm: 2.5}\n", ""));
  ASSERT_TRUE(patient.skin_source);
  EXPECT_TRUE(patient.skin_source->ids.empty());
  EXPECT_EQ(patient.skin_source->close_mm, 0);
}

TEST_F(LabelCase, TheMidPlaneMayBeGiven) {
  const Case patient = read(changed(kCase, "  file: seg.nrrd", "  mid_plane_mm: -3.5\n  file: seg.nrrd"));
  EXPECT_EQ(patient.bones[1].source->plane_mm, -3.5);
}

TEST_F(LabelCase, RefusalsOfSources) {
  refused("labels: [3], side: right", "labels: [3], file: a.stl",
          "6:bones[1].labels: the entry has two sources, file and labels (keep one of them)");
  refused("labels: [3], side: right, ", "", "6:bones[1]: lacks the key 'file'");
  refused("labels: [3], side: right", "file: a.stl, side: right",
          "6:bones[1].side: applies to labels only (leave it out)");
  refused("labels: [3], side: right", "labels: [3], frame: RAS",
          "6:bones[1].frame: does not apply to labels (leave it out)");
  refused("side: right", "side: rigth", "6:bones[1].side: 'rigth' is no side (write left or right)");
  refused("labels: [3], side", "labels: [3, 88], side",
          "6:bones[1].labels: label 88 is not in the label map (mend the id, or leave it out)");
  refused("labels: [3], side", "labels: [], side", "6:bones[1].labels: is empty (name at least one label)");
  refused("labels: [3], side", "labels: [0], side",
          "6:bones[1].labels[0]: label 0 is nothing (leave it out)");
  refused("labels: [3], side", "labels: [Femra], side",
          "6:bones[1].labels[0]: unknown label 'Femra' (did you mean 'Femora'?)");
  refused("labels: [3], side", "labels: all, side", "6:bones[1].labels: unknown label 'all'");
  refused("labels: [3], side", "labels: {a: b}, side", "6:bones[1].labels: must be a plain value, is a map");
  refused("close_mm: 2.5", "close_mm: 250", "3:skin.close_mm: 250 is out of range (give 0 to 100)");
  refused("close_mm: 2.5", "close_mm: -1", "3:skin.close_mm: -1 is out of range");
  refused("close_mm: 2.5", "close: 2", "3:skin.close: unknown key 'close'");
}

TEST_F(LabelCase, RefusalsOfWithin) {
  refused(
      "file: regions.nrrd", "file: other.nrrd",
      "7:bones[2].within.file: its voxels are not those of the label map: 20 x 10 x 9 voxels of 2 x 2.1 x 2 "
      "mm "
      "from [-19, 0, 0], not 20 x 10 x 9 voxels of 2 x 2 x 2 mm from [-19, 0, 0] (resample it onto the label "
      "map's grid)");
  refused("file: regions.nrrd", "file: field.nrrd",
          "7:bones[2].within.file: its voxels are not one whole number each (use a label map)");
  refused("file: regions.nrrd", "file: none.nrrd", "7:bones[2].within.file: no such file",
          ErrorKind::missing_input);
  refused("ids: [1]", "ids: [5]",
          "7:bones[2].within.ids[0]: value 5 is not in that image (mend it, or leave it out)");
  refused("ids: [1]", "ids: []", "7:bones[2].within.ids: is empty (name at least one value)");
  refused("ids: [1]", "id: [1]", "7:bones[2].within.id: unknown key 'id' (did you mean 'ids'?)");
}

TEST_F(LabelCase, RefusalsOfTheRest) {
  refused("{labels: rest", "{labels: rest, name: all", "10:tissues[1].name: unknown key 'name'");
  refused("  - {name: liver, labels: [Liver], group: organ}\n",
          "  - {name: vessels, labels: [Liver]}\n  - {name: vessels_6, labels: [5]}\n",
          "11:tissues[2]: no name is left for label 6 (list it with a name of its own)");
  ImageGrid grid;
  grid.size = {41, 41, 41};
  grid.spacing = {1, 1, 1};
  Image picture(grid, ScalarType::u32);
  std::uint32_t next = 1;
  for (std::uint32_t& v : picture.scalars<std::uint32_t>()) v = next++;
  write_image(scratch_ / "picture.nrrd", picture);
  refused("seg.nrrd", "picture.nrrd",
          "3:skin.labels: the label map has more than 65536 ids (is it a label map, or a picture?)");
  refused("group: fat", "group: fta", "10:tissues[1].group: unknown group 'fta' (did you mean 'fat'?)");
  refused("{muscle:", "{muscles:", "10:tissues[1].groups.muscles: unknown group 'muscles'");
  refused("[6, 9]", "[5]", "10:tissues[1].groups.vessel: label 5 stands in two groups (keep one)");
  refused("  - {name: liver, labels: [Liver], group: organ}", "  - {labels: rest}",
          "10:tissues[1]: stands twice, first at ");
  refused("labels: [Liver]", "labels: [4, 5, 6, 7, 8]",
          "10:tissues[1]: no label of the table is left (leave it out)");
}

TEST_F(LabelCase, LimbsToBeHeldApartAreRead) {
  const std::string apart =
      "labels:\n  apart: {gap_mm: 4.5, limbs: [{labels: [Femora, 5], segments: [thigh_right], joints: 3}]}\n";
  const Case patient = read(changed(kCase, "labels:\n", apart));
  ASSERT_TRUE(patient.labels->apart);
  const HeldApart& held = *patient.labels->apart;
  EXPECT_EQ(held.gap_mm, 4.5);
  ASSERT_EQ(held.limbs.size(), 1u);
  EXPECT_EQ(held.limbs[0].ids, (std::vector<std::int64_t>{3, 5}));
  EXPECT_EQ(held.limbs[0].segments, (std::vector<std::string>{"thigh_right"}));
  EXPECT_EQ(held.limbs[0].joints, 3);
  EXPECT_TRUE(held.where.ends_with("case.yaml:12:labels.apart")) << held.where;
  EXPECT_EQ(patient.tissues.size(), 4u);  // its labels stand for no surface
  EXPECT_FALSE(read(kCase).labels->apart);
  const Case usual = read(changed(
      kCase, "labels:\n", "labels:\n  apart: {gap_mm: 4, limbs: [{labels: 3, segments: [thigh_right]}]}\n"));
  EXPECT_EQ(usual.labels->apart->limbs[0].joints, 2);
  const Case without =
      read(changed(kCase, "labels:\n", "labels:\n  apart: {gap_mm: 4, limbs: [{labels: 3}]}\n"));
  EXPECT_TRUE(without.labels->apart->limbs[0].segments.empty());
}

TEST_F(LabelCase, RefusalsOfLimbsToBeHeldApart) {
  const std::string where = "12:labels.apart";
  const auto refuse = [&](const std::string& apart, const std::string& part) {
    refused("labels:\n  file", "labels:\n  apart: {" + apart + "}\n  file", where + part);
  };
  const std::string limbs = "limbs: [{labels: [3], segments: [thigh_right]}]";
  refuse("gap_mm: 0, " + limbs, ".gap_mm: 0 is out of range (give more than 0, at most 100)");
  refuse("gap_mm: 101, " + limbs, ".gap_mm: 101 is out of range");
  refuse("gap: 3, " + limbs, ".gap: unknown key 'gap' (use gap_mm, limbs)");
  refuse("gap_mm: 3, limbs: []", ".limbs: lists no limbs, or more than 100 (list 1 to 100 entries)");
  refuse("gap_mm: 3, limbs: [{labels: [3], segments: []}]",
         ".limbs[0].segments: is empty (name the uppermost segment of a limb)");
  refuse("gap_mm: 3, limbs: [{labels: [3], segments: [thigh_rigth]}]",
         ".limbs[0].segments[0]: unknown segment 'thigh_rigth' (did you mean 'thigh_right'?)");
  refuse("gap_mm: 3, limbs: [{labels: [3], segments: [pelvis]}]",
         ".limbs[0].segments[0]: 'pelvis' is the root, on which everything hangs (name the uppermost of a "
         "limb)");
  refuse("gap_mm: 3, limbs: [{labels: [3], segments: [thigh_right]}, {labels: [5], segments: [thigh_right]}]",
         ".limbs[1].segments[0]: 'thigh_right' is of one limb with 'thigh_right' (name the uppermost alone)");
  refuse("gap_mm: 3, limbs: [{labels: [3, Femora], segments: [thigh_right]}]",
         ".limbs[0].labels: label 3 stands twice (keep one)");
  refuse("gap_mm: 3, limbs: [{labels: [88], segments: [thigh_right]}]",
         ".limbs[0].labels: label 88 is not in the label map");
  refuse("gap_mm: 3, limbs: [{labels: [3], segments: [thigh_right], joints: 0}]",
         ".limbs[0].joints: 0 is out of range (give 1 to 16)");
  refuse("gap_mm: 3, limbs: [{labels: [3], segments: [thigh_right], joints: 17}]",
         ".limbs[0].joints: 17 is out of range");
  refuse("gap_mm: 3, limbs: [{labels: [3], segment: [thigh_right]}]",
         ".limbs[0].segment: unknown key 'segment' (did you mean 'segments'?)");
}

TEST_F(LabelCase, RefusalsWithoutALabelMap) {
  const std::string none = kCase.substr(0, kCase.find("labels:\n"));
  expect_error(ErrorKind::config,
               "case.yaml:3:skin.labels: the case has no label map (name one: labels: {file: .., table: ..})",
               [&] { read(none); });
  expect_error(ErrorKind::config, "case.yaml:1: lacks the key 'skin' (add it)",
               [&] { read(changed(none, "skin: {labels: all, close_mm: 2.5}\n", "")); });
}

TEST_F(LabelCase, ASideWithoutVoxelsIsRefusedWithItsPlace) {
  Case patient = read(changed(kCase, "  file: seg.nrrd", "  mid_plane_mm: -300\n  file: seg.nrrd"));
  expect_error(ErrorKind::config, "case.yaml:6:bones[1]: its labels have no voxel there",
               [&] { label_surfaces::resolve(patient, Context{}); });
}

}  // namespace
}  // namespace ecorche::io
