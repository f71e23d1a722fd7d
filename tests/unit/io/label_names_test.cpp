// SPDX-License-Identifier: Apache-2.0
// Names of labels as programs write them: in a NIfTI's header, in a JSON, as file names, as codes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

#include <ecorche/values/error.hpp>
#include "io/image/image_file.hpp"
#include "io/image/label_json.hpp"
#include "io/image/label_table.hpp"
#include "io/image/mask_folder.hpp"
#include "io/image/merge_labels.hpp"
#include "io/image/nifti_names.hpp"
#include "io/image/same_grid.hpp"
#include "io/image/segmentation.hpp"
#include "io/image/terminology.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

using Names = std::map<std::int64_t, std::string>;

Image labels(std::vector<std::uint8_t> voxels) {
  ImageGrid grid;
  grid.size = {static_cast<std::int32_t>(voxels.size()), 1, 1};
  Image image(grid, ScalarType::u8);
  std::copy(voxels.begin(), voxels.end(), image.scalars<std::uint8_t>().begin());
  return image;
}

template <class T>
std::vector<int> voxels_as(const Image& image) {
  const auto voxels = image.scalars<T>();
  return {voxels.begin(), voxels.end()};
}

// A `.nii` of four voxels with one extension of this text.
std::string nifti(const std::string& text, std::int32_t declared = -1) {
  std::string bytes(352, '\0');
  const auto put = [&](std::size_t at, auto value) { std::memcpy(bytes.data() + at, &value, sizeof value); };
  std::string extension(8, '\0');
  std::string padded = text;
  padded.resize((text.size() + 8 + 15) / 16 * 16 - 8, '\0');
  const auto size = declared >= 0 ? declared : static_cast<std::int32_t>(padded.size() + 8);
  std::memcpy(extension.data(), &size, 4);
  put(0, std::int32_t{348});
  put(40, std::int16_t{3});
  for (std::size_t at = 42; at <= 46; at += 2) put(at, static_cast<std::int16_t>(at == 42 ? 4 : 1));
  put(70, std::int16_t{2});
  put(72, std::int16_t{8});
  for (std::size_t at = 76; at <= 88; at += 4) put(at, 1.0F);
  put(108, static_cast<float>(352 + padded.size() + 8));
  put(252, std::int16_t{1});
  std::memcpy(bytes.data() + 344, "n+1", 4);
  bytes[348] = 1;
  return bytes + extension + padded + std::string("\x00\x05\x05\x09", 4);
}

std::string table(const std::string& label) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?> <CaretExtension><LabelTable>" + label +
         "</LabelTable></CaretExtension>";
}

TEST(NiftiNames, AreThoseOfTheCaretTable) {
  const Scratch scratch;
  const auto file = scratch.put(
      "a.nii",
      nifti(table(
          "<Label Key=\"0\"><![CDATA[???]]></Label><Label Key=\"5\" Red=\"1\"><![CDATA[femur_left]]></Label>"
          "<Label Key=\" 9 \">hip &amp; thigh</Label><Label Key=\"x\">nothing</Label><Label>none</Label>")));
  EXPECT_EQ(read_nifti_names(file), (Names{{5, "femur_left"}, {9, "hip & thigh"}}));
  // And they are the label map's names, without a table.
  EXPECT_EQ(read_segmentation(file).names, (LabelNames{{5, "femur_left"}, {9, "hip_thigh"}}));
}

TEST(NiftiNames, ComeBackAsTheyWereWritten) {
  const Scratch scratch;
  const Names names{{1, "spleen"}, {2, "rib_left_4"}, {117, "costal_cartilages"}};
  const auto file = scratch.path() / "ml.nii.gz";
  write_named_nifti(file, labels({0, 1, 2, 117}), names);
  EXPECT_EQ(read_nifti_names(file), names);
  EXPECT_EQ(voxels_as<std::uint8_t>(read_segmentation(file).layers[0]), (std::vector<int>{0, 1, 2, 117}));
}

TEST(NiftiNames, ForeignExtensionsNameNothing) {
  const Scratch scratch;
  for (const std::string& text :
       {std::string(), std::string("<Label"), std::string("no xml at all <Label Key='1'>a</Label>"),
        table("<Label Key=\"1\">a</Label>").substr(0, 90),
        // Names that would grow without bound.
        "<!DOCTYPE a [<!ENTITY b \"aaaaaaaaaaaaaaaaaaaa\"><!ENTITY c \"&b;&b;&b;&b;&b;&b;&b;&b;\">]>" +
            table("<Label Key=\"1\">&c;&c;&c;&c;</Label>")}) {
    EXPECT_EQ(read_nifti_names(scratch.put("a.nii", nifti(text))), Names()) << text;
  }
  for (const std::int32_t size : {0, 8, 15, 1 << 30, 2147483647, -5})
    EXPECT_EQ(read_nifti_names(
                  scratch.put("a.nii", nifti(table("<Label Key=\"1\">a</Label>"), size < 0 ? 7 : size))),
              Names());
  EXPECT_EQ(read_nifti_names(scratch.put("a.nrrd", "NRRD0004\n")), Names());
}

TEST(NiftiNames, DamagedFilesDoNoHarm) {
  const Scratch scratch;
  const std::string whole = nifti(table("<Label Key=\"5\"><![CDATA[femur_left]]></Label>"));
  for (std::size_t length = 0; length < whole.size(); length += 3)
    EXPECT_NO_THROW(read_nifti_names(scratch.put("a.nii", whole.substr(0, length))));
  std::mt19937 random(1);
  for (int round = 0; round < 500; ++round) {
    std::string bytes = whole;
    for (int flips = 0; flips < 8; ++flips) bytes[random() % bytes.size()] = static_cast<char>(random());
    EXPECT_NO_THROW(read_nifti_names(scratch.put("a.nii", bytes)));
  }
}

TEST(LabelJson, KnowsMooseAndNnUnetAndPlainTables) {
  const Scratch scratch;
  const JsonLabels moose = read_label_json(scratch.put(
      "a.json",
      R"({"organ_indices": {"1": {"name": "carpal_left", "SNOMED": {"code": "83936004"}}, "2": {"name": "x", "SNOMED": 7}}})"));
  EXPECT_EQ(moose.names, (Names{{1, "carpal_left"}, {2, "x"}}));
  EXPECT_EQ(moose.codes.at(1).type.value, "83936004");
  EXPECT_EQ(moose.codes.at(2).type.value, "7");
  EXPECT_EQ(read_label_json(scratch.put("b.json", R"({"labels": {"background": 0, "liver": 3}})")).names,
            (Names{{3, "liver"}}));
  EXPECT_EQ(read_label_table(scratch.put("c.json", R"({"4": "Femur, left"})")),
            (LabelNames{{4, "femur_left"}}));
}

TEST(LabelJson, RefusesWhatNamesNoLabel) {
  const Scratch scratch;
  for (const std::string& text :
       {std::string("{"), std::string("[1]"), std::string("{}"), std::string("{\"a\": {\"b\": 1}}"),
        std::string(100000, '['), std::string("{\"1\": 5}")})
    EXPECT_THROW(read_label_json(scratch.put("a.json", text)), Error) << text.substr(0, 40);
}

TEST(Masks, AreOneLabelAFileAndEmptyOnesAreAbsent) {
  const Scratch scratch;
  write_image(scratch.path() / "femur_left.nii.gz", labels({0, 1, 1, 0}));
  write_image(scratch.path() / "body.nii.gz", labels({1, 1, 1, 1}));
  write_image(scratch.path() / "liver.nii.gz", labels({0, 0, 0, 0}));
  write_image(scratch.path() / "hip.nii.gz", labels({7, 0, 0, 0}));
  std::size_t empty = 0;
  const Segmentation read = read_masks(images_within(scratch.path()), {}, Context{}, &empty);
  EXPECT_EQ(empty, 1u);
  EXPECT_EQ(read.names, (LabelNames{{1, "body"}, {2, "femur_left"}, {3, "hip"}}));
  // What overlaps lies in another layer: nothing is lost.
  ASSERT_EQ(read.layers.size(), 2u);
  EXPECT_EQ(voxels_as<std::uint16_t>(read.layers[0]), (std::vector<int>{1, 1, 1, 1}));
  EXPECT_EQ(voxels_as<std::uint16_t>(read.layers[1]), (std::vector<int>{3, 2, 2, 0}));
}

std::string refusal(const std::filesystem::path& folder) {
  try {
    read_masks(images_within(folder), {}, Context{});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Masks, RefusalsSayWhatToDo) {
  const Scratch scratch;
  EXPECT_NE(refusal(scratch.path()).find("holds no image"), std::string::npos);
  write_image(scratch.path() / "a.nii.gz", labels({0, 0}));
  EXPECT_NE(refusal(scratch.path()).find("each of its 1 masks is empty"), std::string::npos);
  write_image(scratch.path() / "b.nii.gz", labels({0, 1, 1}));
  EXPECT_NE(refusal(scratch.path()).find("its voxels are not those of a.nii.gz: 3 x 1 x 1 voxels"),
            std::string::npos);
  write_image(scratch.path() / "a.nii.gz", labels({0, 1, 2}));
  EXPECT_NE(refusal(scratch.path()).find("is no mask: it holds several labels, among them 1 and 2"),
            std::string::npos);
}

TEST(MergedLabels, EarlierMapsComeFirstAndIdsMeanOneThing) {
  Segmentation a{{labels({0, 2, 2, 0, 0})}, {{2, "femur"}}},
      b{{labels({2, 2, 0, 1, 0})}, {{1, "tibia"}, {2, "femur"}}}, c{{labels({9, 9, 9, 9, 0})}, {{9, "body"}}};
  const Segmentation all = merged({std::move(a), std::move(b), std::move(c)});
  EXPECT_EQ(all.names, (LabelNames{{1, "femur"}, {2, "tibia"}, {3, "femur"}, {4, "body"}}));
  EXPECT_EQ(voxels_as<std::uint16_t>(all.layers[0]), (std::vector<int>{3, 1, 1, 2, 0}));
  Segmentation one{{labels({5, 6})}, {{5, "x"}, {6, "y"}}};
  leave_out(one, {5});
  EXPECT_EQ(one.names, (LabelNames{{6, "y"}}));
  const Segmentation same = merged({std::move(one)});
  EXPECT_EQ(voxels_as<std::uint8_t>(same.layers[0]), (std::vector<int>{0, 6}));  // alone it keeps its ids
}

TEST(MergedLabels, LayersOfOneMapStayWhole) {
  Segmentation a{{labels({1, 1, 0})}, {{1, "lung"}}};
  a.layers.push_back(labels({0, 2, 0}));
  a.names[2] = "nodule";
  Segmentation b{{labels({7, 7, 7})}, {{7, "body"}}};
  const Segmentation all = merged({std::move(a), std::move(b)});
  EXPECT_EQ(voxels_as<std::uint16_t>(all.layers[0]), (std::vector<int>{1, 1, 3}));
  EXPECT_EQ(voxels_as<std::uint16_t>(all.layers[1]), (std::vector<int>{0, 2, 0}));
}

TEST(SameGrid, NearestIsTheObviousOne) {
  ImageGrid from, to;
  from.size = {4, 3, 5};
  from.spacing = {2, 3, 1.5};
  from.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  to.size = {9, 8, 7};
  to.origin = {-7, -1, 0.2};
  Image image(from, ScalarType::u16);
  for (std::size_t v = 0; v < from.voxels(); ++v)
    image.scalars<std::uint16_t>()[v] = static_cast<std::uint16_t>(v + 1);
  const Image out = resampled_nearest(image, to);
  for (int k = 0; k < 7; ++k) {
    for (int j = 0; j < 8; ++j) {
      for (int i = 0; i < 9; ++i) {
        const auto at = from.index(to.point(i, j, k));
        const std::array<int, 3> n{static_cast<int>(std::floor(at[0] + 0.5)),
                                   static_cast<int>(std::floor(at[1] + 0.5)),
                                   static_cast<int>(std::floor(at[2] + 0.5))};
        const bool in = n[0] >= 0 && n[1] >= 0 && n[2] >= 0 && n[0] < 4 && n[1] < 3 && n[2] < 5;
        EXPECT_EQ(out.scalars<std::uint16_t>()[to.offset(i, j, k)],
                  in ? image.scalars<std::uint16_t>()[from.offset(n[0], n[1], n[2])] : 0);
      }
    }
  }
}

TEST(Terminology, ComesBackAndIsReadFromSlicersTags) {
  const SegmentCodes codes = parse_terminology(
      "Segmentation category and type - DICOM master list~SCT^123037004^Anatomical "
      "Structure~SCT^272673000^Bone~^^~Anatomic "
      "codes~SCT^71341001^Femur~SCT^7771000^Left");
  EXPECT_EQ(codes.type.meaning, "Bone");
  EXPECT_EQ(codes.region.value, "71341001");
  EXPECT_EQ(codes.region_side.value, "7771000");
  EXPECT_EQ(parse_terminology(terminology_entry(codes)), codes);
  EXPECT_EQ(parse_terminology(""), SegmentCodes());
  EXPECT_EQ(parse_terminology("~~~~^^^"), SegmentCodes());
  const Scratch scratch;
  Segmentation map{{labels({0, 1})}, {{1, "femur"}}};
  map.codes[1] = codes;
  write_segmentation(scratch.path() / "a.seg.nrrd", map);
  EXPECT_EQ(read_segmentation(scratch.path() / "a.seg.nrrd").codes.at(1), codes);
}

}  // namespace
}  // namespace ecorche::io
