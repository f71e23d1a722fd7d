// SPDX-License-Identifier: Apache-2.0
// Label maps that name their own segments, and the tables of other programs.
#include <gtest/gtest.h>

#include <random>

#include <ecorche/io/case_file.hpp>
#include "io/image/image_file.hpp"
#include "io/image/label_table.hpp"
#include "io/image/segmentation.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::io {
namespace {

// As 3D Slicer writes it: two layers side by side, negative second axis.
std::string slicer_file(const std::string& segments, int layers, const std::string& voxels) {
  const bool several = layers > 1;
  return "NRRD0004\n# Complete NRRD file format specification at:\ntype: unsigned char\ndimension: " +
         std::string(several ? "4" : "3") +
         "\nspace: left-posterior-superior\nsizes: " + (several ? std::to_string(layers) + " " : "") +
         "2 1 2\nspace directions: " + (several ? "none " : "") +
         "(1,0,0) (0,-2,0) (0,0,3)\nkinds: " + (several ? "list " : "") +
         "domain domain domain\nencoding: raw\nspace origin: (5,6,7)\n" + segments + "\n" + voxels;
}

std::string segment(int i, const std::string& name, int value, int layer) {
  const std::string at = "Segment" + std::to_string(i) + "_";
  return at + "Color:=0.5 0.5 0.5\n" + at + "ID:=Segment_" + std::to_string(i) + "\n" + at +
         "LabelValue:=" + std::to_string(value) + "\n" + at + "Layer:=" + std::to_string(layer) + "\n" + at +
         "Name:=" + name + "\n";
}

TEST(Segmentation, ItsSegmentsAreNamed) {
  const Scratch scratch;
  const Segmentation read = read_segmentation(scratch.put(
      "a.seg.nrrd", slicer_file(segment(0, "Femur (right)", 3, 0) + segment(1, "femur right", 7, 0), 1,
                                std::string("\x00\x03\x07\x09", 4))));
  EXPECT_EQ(read.names, (LabelNames{{3, "femur_right"}, {7, "femur_right_7"}}));
  ASSERT_EQ(read.layers.size(), 1u);
  EXPECT_EQ(read.layers[0].scalars<std::uint8_t>()[2], 7);
  EXPECT_EQ(read.layers[0].grid.point(0, 0, 1), (std::array<double, 3>{5, 6, 10}));
  EXPECT_EQ(read.layers[0].grid.direction[4], -1);
}

TEST(Segmentation, OverlappingLayersKeepBothIds) {
  const Scratch scratch;
  const std::string voxels("\x01\x00\x01\x01\x00\x02\x09\x01", 8);  // (layer 0, layer 1) of four voxels
  // Values that mean two things: numbered anew.
  const Segmentation anew = read_segmentation(scratch.put(
      "a.seg.nrrd",
      slicer_file(segment(0, "liver", 1, 0) + segment(1, "lesion", 1, 1) + segment(2, "vein", 2, 1), 2,
                  voxels)));
  ASSERT_EQ(anew.layers.size(), 2u);
  EXPECT_EQ(anew.names, (LabelNames{{1, "liver"}, {2, "lesion"}, {3, "vein"}}));
  const auto ids = [](const Image& layer) {
    const auto voxel = layer.scalars<std::uint16_t>();
    return std::vector<int>(voxel.begin(), voxel.end());
  };
  EXPECT_EQ(ids(anew.layers[0]), (std::vector<int>{1, 1, 0, 0}));  // 9 is no segment's
  EXPECT_EQ(ids(anew.layers[1]), (std::vector<int>{0, 2, 3, 2}));
  // Values that mean one thing are kept.
  const Segmentation kept = read_segmentation(scratch.put(
      "b.seg.nrrd",
      slicer_file(segment(0, "liver", 9, 0) + segment(1, "lesion", 1, 1) + segment(2, "vein", 2, 1), 2,
                  voxels)));
  EXPECT_EQ(kept.names, (LabelNames{{1, "lesion"}, {2, "vein"}, {9, "liver"}}));
  EXPECT_EQ(ids(kept.layers[0]), (std::vector<int>{0, 0, 0, 9}));
  EXPECT_EQ(ids(kept.layers[1]), (std::vector<int>{0, 1, 2, 1}));
  // Before layers had numbers: a component a segment.
  const Segmentation old = read_segmentation(
      scratch.put("c.seg.nrrd", slicer_file("Segment0_ID:=liver\nSegment1_ID:=lesion\n", 2, voxels)));
  EXPECT_EQ(old.names, (LabelNames{{1, "liver"}, {2, "lesion"}}));
  EXPECT_EQ(ids(old.layers[1]), (std::vector<int>{0, 2, 0, 2}));
}

TEST(Segmentation, WhatIsWrittenComesBack) {
  const Scratch scratch;
  Segmentation made;
  ImageGrid grid;
  grid.size = {4, 3, 2};
  grid.spacing = {1, 2, 3};
  grid.direction = {1, 0, 0, 0, -1, 0, 0, 0, 1};
  std::mt19937 random(3);
  for (int layer = 0; layer < 3; ++layer) {
    Image image(grid, ScalarType::u16);
    for (auto& v : image.scalars<std::uint16_t>())
      v = static_cast<std::uint16_t>(random() % 3 == 0 ? 0 : 300 * layer + 1);
    made.layers.push_back(image);
  }
  made.names = {{1, "bone"}, {301, "vein"}, {601, "nerve"}};
  write_segmentation(scratch / "a.seg.nrrd", made);
  const Segmentation back = read_segmentation(scratch / "a.seg.nrrd");
  EXPECT_EQ(back.names, made.names);
  ASSERT_EQ(back.layers.size(), 3u);
  for (std::size_t layer = 0; layer < 3; ++layer)
    EXPECT_EQ(back.layers[layer].bytes, made.layers[layer].bytes);
  EXPECT_EQ(back.layers[0].grid, grid);
}

TEST(Segmentation, EveryMistakeIsNamed) {
  const Scratch scratch;
  const auto refused = [&](const std::string& part, const std::string& segments, int layers) {
    const auto path = scratch.put(
        "a.seg.nrrd", slicer_file(segments, layers, std::string(static_cast<std::size_t>(4 * layers), '\1')));
    expect_error(ErrorKind::data, part, [&] { read_segmentation(path); });
  };
  refused("Segment1 lies in layer 2 of 2", segment(0, "a", 1, 0) + segment(1, "b", 1, 2), 2);
  refused("Segment0 has the label value 0, which is nothing", segment(0, "a", 0, 0), 1);
  refused("two segments of one layer have the label value 4", segment(0, "a", 4, 0) + segment(1, "b", 4, 0),
          1);
  refused("Segment0_LabelValue is 'x'", "Segment0_Name:=a\nSegment0_LabelValue:=x\n", 1);
  refused("labels are u8 x 2 (labels are whole numbers, one a voxel)", "", 2);
}

TEST(Segmentation, IsWrittenUnderItsOwnNameOnly) {
  expect_error(ErrorKind::usage, "a.nrrd: segmentations are written as .seg.nrrd (name it so)",
               [] { write_segmentation("a.nrrd", {}); });
}

TEST(LabelTable, SlicersItkSnapsAndTsv) {
  const Scratch scratch;
  EXPECT_EQ(read_label_table(scratch.put("a.ctbl",
                                         "# Color table\n0 background 0 0 0 0\r\n9 Fat body 225 230 150 255\n"
                                         "12 vastus_lateralis 230 125 125 255\n")),
            (LabelNames{{9, "fat_body"}, {12, "vastus_lateralis"}}));
  EXPECT_EQ(read_label_table(scratch.put(
                "a.txt",
                "################\n# ITK-SnAP Label Description File\n    0     0    0    0        "
                "0  0  0    \"Clear Label\"\n    4   255    0    0        1  1  1    "
                "\"Femur, left\"\n")),
            (LabelNames{{4, "femur_left"}}));
  EXPECT_EQ(read_label_table(scratch.put("b.txt", "2  Left-Cerebral-White-Matter  245 245 245 0\n")),
            (LabelNames{{2, "left_cerebral_white_matter"}}));
  EXPECT_EQ(read_label_table(scratch.put(
                "a.tsv", "name\tabbreviation\tindex\tcolor\nGray Matter\tGM\t1\t#ff0000\n\nBone\tB\t5\t\n")),
            (LabelNames{{1, "gray_matter"}, {5, "bone"}}));
}

TEST(LabelTable, NamesBecomeIdentifiersOfTheirOwn) {
  const std::string longest(80, 'x');
  const LabelNames made = make_identifiers({{1, "A b"},
                                            {2, "a-B"},
                                            {3, "\xc3\xa4 \xe2\x82\xac"},
                                            {4, ""},
                                            {5, longest},
                                            {6, longest},
                                            {7, "a b 2"},
                                            {8, "__1 (x)__"}});
  const std::string cut(64, 'x');
  EXPECT_EQ(made, (LabelNames{{1, "a_b"},
                              {2, "a_b_2"},
                              {3, "label_3"},
                              {4, "label_4"},
                              {5, cut},
                              {6, cut.substr(2) + "_6"},
                              {7, "a_b_2_7"},
                              {8, "1_x"}}));
}

TEST(LabelTable, EveryMistakeIsNamed) {
  const Scratch scratch;
  const auto refused = [&](const std::string& name, const std::string& text, const std::string& part) {
    expect_error(ErrorKind::data, part, [&] { read_label_table(scratch.put(name, text)); });
  };
  refused("a.csv", "x",
          "'.csv' tables cannot be read (use .ctbl, .tsv, .json, or .txt as ITK-SNAP writes it)");
  refused("a.ctbl", "# nothing\n", "names no label");
  refused("a.ctbl", "1 a 0 0 0 0\none b 0 0 0 0\n", "a.ctbl:2: 'one' is no label id (ids are whole numbers)");
  refused("a.ctbl", "1 a 0 0 0 0\n1 b 0 0 0 0\n", "a.ctbl:2: label 1 stands twice (keep one)");
  refused("a.ctbl", "1 a 0 0 0\n", "a.ctbl:1: has 5 columns (a line is: id name r g b a)");
  refused("a.ctbl", "1 a 0 0 0 red\n", "a.ctbl:1: 'red' is no colour");
  refused("a.txt", "1 0 0 0 1 1 \"a\"\n", "a.txt:1: has 6 numbers before its name");
  refused("a.tsv", "id\tcolour\n1\tred\n", "a.tsv:1: has no column 'name'");
  refused("a.tsv", "", "is empty (give a table of labels)");
  refused("a.tsv", "index\tname\n1\n", "a.tsv:2: has 1 columns (one for every head)");
  refused("a.tsv", std::string("index\tname\n1\0\n", 13), "is no text");
}

// The small case in `scratch`, its labels as said.
Case read_with_labels(const Scratch& scratch, const std::string& labels) {
  const std::string head =
      "name: a\nskeleton: skeleton.yaml\nskin: skin.stl\nbones:\n  - {name: pelvis_bone, file: "
      "bones/pelvis_bone.stl, segment: pelvis}\n";
  return read_case(scratch.put("case.yaml", head + "labels: " + labels + "\n"), {scratch.path(), ""},
                   Context{});
}

TEST(CaseLabels, TablesComeFromFilesOrFromTheImage) {
  const Scratch scratch;
  write_case(scratch.path(), small_case(), Context{});
  const auto read = [&](const std::string& labels) { return read_with_labels(scratch, labels); };
  scratch.put("t.ctbl", "1 Pelvis 0 0 0 0\n");
  const std::map<std::int64_t, std::string> pelvis{{1, "pelvis"}};
  EXPECT_EQ(read("{file: volumes/labels.nrrd, table: t.ctbl}").labels->table, pelvis);
  const Case patient = read("{file: volumes/labels.nrrd, table: {file: t.ctbl, root: data}}");
  EXPECT_EQ(patient.labels->table, pelvis);
  EXPECT_TRUE(patient.input_digests.contains("t.ctbl"));
  expect_error(ErrorKind::config, "case.yaml:6:labels: lacks 'table', and its file names no segments",
               [&] { read("{file: volumes/labels.nrrd}"); });
  expect_error(ErrorKind::missing_input, "labels.table: no such file",
               [&] { read("{file: volumes/labels.nrrd, table: u.ctbl}"); });
  scratch.put("a.seg.nrrd", slicer_file(segment(0, "liver", 1, 0) + segment(1, "lesion", 1, 1), 2,
                                        std::string("\1\0\1\1\0\1\0\0", 8)));
  Case layered = read("{file: a.seg.nrrd}");
  EXPECT_EQ(layered.labels->table, (LabelNames{{1, "liver"}, {2, "lesion"}}));
  ASSERT_EQ(layered.labels->overlaps.size(), 1u);
  EXPECT_EQ(layered.labels->overlaps[0].scalars<std::uint16_t>()[2], 2);
  // And as a case of its own.
  write_case(scratch / "again", layered, Context{});
  const Case again = read_case(scratch / "again", {}, Context{});
  EXPECT_EQ(again.labels->table, layered.labels->table);
  EXPECT_EQ(again.labels->image.bytes, layered.labels->image.bytes);
  ASSERT_EQ(again.labels->overlaps.size(), 1u);
  EXPECT_EQ(again.labels->overlaps[0].bytes, layered.labels->overlaps[0].bytes);
}

TEST(CaseLabels, SeveralMapsHaveAnOrder) {
  const Scratch scratch;
  write_case(scratch.path(), small_case(), Context{});
  const auto read = [&](const std::string& labels) { return read_with_labels(scratch, labels); };
  const auto put = [&](const std::string& name, std::vector<std::uint8_t> voxels, double spacing = 1) {
    ImageGrid grid;
    grid.size = {static_cast<std::int32_t>(voxels.size()), 1, 1};
    grid.spacing[0] = spacing;
    Image image(grid, ScalarType::u8);
    std::copy(voxels.begin(), voxels.end(), image.scalars<std::uint8_t>().begin());
    std::filesystem::create_directories((scratch / name).parent_path());
    write_image(scratch / name, image);
  };
  put("a.nrrd", {0, 1, 2, 0});
  put("b.nrrd", {1, 1, 1, 0});
  put("coarse.nrrd", {3, 4}, 2);
  put("masks/liver.nii.gz", {0, 1, 0, 1});
  put("masks/spleen.nii.gz", {0, 0, 0, 0});
  const auto voxels = [](const Case& patient) {
    const auto v = patient.labels->image.scalars<std::uint16_t>();
    return std::vector<int>(v.begin(), v.end());
  };
  const std::string a = "{file: a.nrrd, table: {1: femur, 2: tibia}}", b = "{file: b.nrrd, table: {1: body}}";
  const Case two = read("[" + a + ", " + b + "]");
  EXPECT_EQ(two.labels->table, (LabelNames{{1, "femur"}, {2, "tibia"}, {3, "body"}}));
  EXPECT_EQ(voxels(two), (std::vector<int>{3, 1, 2, 0}));
  EXPECT_EQ(voxels(read("[" + b + ", " + a + "]")), (std::vector<int>{1, 1, 1, 0}));
  EXPECT_EQ(voxels(read("{maps: [" + a + ", " + b + "], mid_plane_mm: 0}")), (std::vector<int>{3, 1, 2, 0}));
  EXPECT_EQ(voxels(read("[{file: a.nrrd, table: {1: femur, 2: tibia}, except: [femur]}, " + b + "]")),
            (std::vector<int>{2, 2, 1, 0}));
  const Case folder = read("[{file: masks}, " + b + "]");
  EXPECT_EQ(folder.labels->table, (LabelNames{{1, "liver"}, {2, "body"}}));
  EXPECT_EQ(voxels(folder), (std::vector<int>{2, 1, 2, 1}));
  EXPECT_TRUE(folder.input_digests.contains("masks/spleen.nii.gz"));
  // What lies on another grid is refused, or resampled by request.
  const std::string coarse = "{file: coarse.nrrd, table: {3: hip, 4: skin_fold}";
  expect_error(
      ErrorKind::config,
      "case.yaml:6:labels[1]: its voxels are not those of the first label map: 2 x 1 x 1 voxels of 2 x 1 x 1 "
      "mm "
      "from [0, 0, 0], not 4 x 1 x 1 voxels of 1 x 1 x 1 mm from [0, 0, 0] (say resample: nearest here",
      [&] { read("[" + a + ", " + coarse + "}]"); });
  EXPECT_EQ(voxels(read("[" + a + ", " + coarse + ", resample: nearest}]")), (std::vector<int>{3, 1, 2, 0}));
  const auto refused = [&](const std::string& labels, const std::string& what) {
    expect_error(ErrorKind::config, what, [&] { read(labels); });
  };
  refused("[]", "case.yaml:6:labels: lists no label map, or more than 64 (list 1 to 64)");
  refused("[{file: a.nrrd, table: {1: femur}, except: [femr]}]", "did you mean 'femur'?");
  refused("{file: a.nrrd, maps: [" + a + "]}", "stands beside maps");
  refused("[{file: masks, table: {1: x}}]", "does not apply to a folder");
  refused("[{file: a.nrrd, table: {1: femur}, gap: 1}]", "gap");
}

}  // namespace
}  // namespace ecorche::io
