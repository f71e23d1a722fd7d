// SPDX-License-Identifier: Apache-2.0
// What stands in images of strangers: labels as real numbers, integers of 64 bits, NaN, axes a little off,
// DICOM.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "io/image/dicom.hpp"
#include "io/image/image_file.hpp"
#include "io/image/right_angles.hpp"
#include "io/image/segmentation.hpp"
#include "io/image/whole_labels.hpp"
#include "tests/support/peak_memory.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

template <class T>
std::string packed(const std::vector<T>& values) {
  std::string out(values.size() * sizeof(T), '\0');
  std::memcpy(out.data(), values.data(), out.size());
  return out;
}

constexpr const char* kDirections = "(1,0,0) (0,1,0) (0,0,1)";

// 2 x 2 x 2 voxels.
std::string nrrd(const std::string& type, const std::string& voxels,
                 const std::string& directions = kDirections) {
  return "NRRD0004\ntype: " + type +
         "\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 2 2\nspace directions: " + directions +
         "\nkinds: domain domain domain\nendian: little\nencoding: raw\nspace origin: (0,0,0)\n\n" + voxels;
}

std::string meta(const std::string& type, const std::string& voxels) {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
         "False\n"
         "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nElementSpacing = 1 1 1\nDimSize = 2 2 2\n"
         "ElementType = " +
         type + "\nElementDataFile = LOCAL\n" + voxels;
}

// A NIfTI-1 of 2 x 2 x 2 voxels that lies by its sform alone, whose first axis is turned by `degrees` towards
// the second.
std::string nifti(std::int16_t type, std::int16_t bits, const std::string& voxels, double degrees = 0) {
  std::string out(352, '\0');
  const auto set = [&](std::size_t at, auto value) { std::memcpy(out.data() + at, &value, sizeof value); };
  set(0, std::int32_t{348});
  for (const auto& [k, size] :
       {std::pair<std::size_t, int>{0, 3}, {1, 2}, {2, 2}, {3, 2}, {4, 1}, {5, 1}, {6, 1}, {7, 1}})
    set(40 + 2 * k, static_cast<std::int16_t>(size));
  set(70, type);
  set(72, bits);
  for (std::size_t k = 0; k < 4; ++k) set(76 + 4 * k, 1.0F);
  set(108, 352.0F);
  set(123, std::uint8_t{2});
  set(254, std::int16_t{1});
  const double angle = degrees * std::numbers::pi / 180;
  set(280, static_cast<float>(std::cos(angle)));
  set(296, static_cast<float>(std::sin(angle)));
  set(300, 1.0F);
  set(320, 1.0F);
  std::memcpy(out.data() + 344, "n+1", 4);
  return out + voxels;
}

template <class T>
std::vector<T> values(const Image& image) {
  const auto scalars = image.scalars<T>();
  return {scalars.begin(), scalars.end()};
}

const std::vector<double> kLabels{0, 1, 2, 3, 200, 0, 0, 7};

template <class T>
std::vector<T> labels() {
  return {kLabels.begin(), kLabels.end()};
}

TEST(ImageLabels, RealNumbersThatAreWholeAreLabels) {
  const Scratch scratch;
  const auto expect = [&](const std::string& name, const std::string& bytes) {
    const Segmentation read = read_segmentation(scratch.put(name, bytes));
    EXPECT_EQ(values<std::uint8_t>(read.layers.at(0)), labels<std::uint8_t>()) << name;
  };
  expect("f32.nrrd", nrrd("float", packed(labels<float>())));
  expect("f64.nrrd", nrrd("double", packed(labels<double>())));
  expect("f32.mha", meta("MET_FLOAT", packed(labels<float>())));
  expect("f64.mha", meta("MET_DOUBLE", packed(labels<double>())));
  expect("f32.nii", nifti(16, 32, packed(labels<float>())));
  expect("f64.nii", nifti(64, 64, packed(labels<double>())));
  // The narrowest type that holds them.
  EXPECT_EQ(
      read_label_image(scratch.put("a.nrrd", nrrd("float", packed<float>({0, 1, 2, 3, 4, 5, 6, 65535}))))
          .type,
      ScalarType::u16);
  EXPECT_EQ(values<std::int32_t>(read_label_image(scratch.put(
                "a.nrrd", nrrd("double", packed<double>({-1, 1, 2, 3, 4, 5, 6, 2147483647})))))[7],
            2147483647);
}

TEST(ImageLabels, IntegersOf64BitsAreNarrowed) {
  const Scratch scratch;
  const auto expect = [&](const std::string& name, const std::string& bytes) {
    EXPECT_EQ(values<std::int32_t>(read_segmentation(scratch.put(name, bytes)).layers.at(0)),
              labels<std::int32_t>())
        << name;
  };
  for (const char* type : {"int64", "int64_t", "long long", "signed long long int", "longlong"})
    expect("a.nrrd", nrrd(type, packed(labels<std::int64_t>())));
  for (const char* type : {"uint64", "uint64_t", "unsigned long long int", "ulonglong"})
    expect("a.nrrd", nrrd(type, packed(labels<std::uint64_t>())));
  expect("a.mha", meta("MET_LONG_LONG", packed(labels<std::int64_t>())));
  expect("u.mha", meta("MET_ULONG_LONG", packed(labels<std::uint64_t>())));
  expect("a.nii", nifti(1024, 64, packed(labels<std::int64_t>())));
  expect("u.nii", nifti(1280, 64, packed(labels<std::uint64_t>())));
  std::string swapped = packed(labels<std::int64_t>());
  for (std::size_t at = 0; at < swapped.size(); at += 8)
    std::reverse(swapped.begin() + static_cast<std::ptrdiff_t>(at),
                 swapped.begin() + static_cast<std::ptrdiff_t>(at) + 8);
  std::string big = nrrd("int64", swapped);
  expect("b.nrrd", big.replace(big.find("little"), 6, "big"));
  expect_error(
      ErrorKind::data, "a.nrrd: holds the value 4294967296 (whole numbers fit 32 bits: save them so)", [&] {
        read_image(
            scratch.put("a.nrrd", nrrd("int64", packed<std::int64_t>({0, 1, 2, 3, 4, 5, 6, 4294967296}))));
      });
}

TEST(ImageLabels, OthersAreNamedWithTheirPlace) {
  const Scratch scratch;
  const auto refused = [&](const std::vector<double>& voxels, const std::string& part) {
    expect_error(ErrorKind::data, part,
                 [&] { read_segmentation(scratch.put("l.nrrd", nrrd("double", packed(voxels)))); });
  };
  refused(
      {0, 1, 2, 1.5, 2.5, 0, 0, 0},
      "l.nrrd: 2 of 8 labels are no whole numbers, the first 1.5 at voxel (1, 1, 0) (if it was resampled, "
      "resample the label map by nearest neighbour)");
  const double nan = std::nan("");
  refused({0, nan, -INFINITY, 1, 2, 3, 4, 5},
          "l.nrrd: 2 of 8 labels are NaN or infinite (labels are whole numbers: set those voxels to 0)");
  refused({0, 0, 0, 0, 0, 0, 2147483648.0, 1},
          "l.nrrd: holds the label 2.14748365e+09 at voxel (0, 1, 1) (labels fit 32 bits: renumber them)");
  refused({0, 0, 0, 0, 0, 0, -2147483649.0, 1}, "l.nrrd: holds the label -2.14748365e+09 at voxel (0, 1, 1)");
}

TEST(ImageValues, ThatAreNotFiniteAreCountedAndReplaced) {
  const Scratch scratch;
  const float inf = std::numeric_limits<float>::infinity(), nan = std::nanf("");
  Said said;
  const auto path =
      scratch.put("ct.nrrd", nrrd("float", packed<float>({nan, 40, inf, -1000, 7, -inf, 0, 1})));
  EXPECT_EQ(values<float>(read_image(path, said.options)),
            (std::vector<float>{-1000, 40, -1000, -1000, 7, -1000, 0, 1}));
  ASSERT_EQ(said.lines.size(), 1U);
  EXPECT_EQ(said.lines[0], path.string() +
                               ": 3 of 8 values are NaN or infinite: taken as -1000, the least of the others "
                               "(write other values there if that is not meant)");
  // Displacements have no least.
  Image field(read_image(path).grid, ScalarType::f64, 3);
  field.scalars<double>()[5] = std::nan("");
  field.scalars<double>()[6] = -3;
  write_image(scratch / "d.mha", field);
  EXPECT_EQ(read_image(scratch / "d.mha", said.options).scalars<double>()[5], 0);
  EXPECT_EQ(said.lines.back(), (scratch / "d.mha").string() +
                                   ": 1 of 24 values are NaN or infinite: taken as 0 "
                                   "(write other values there if that is not meant)");
  expect_error(ErrorKind::data, "n.nrrd: none of its 8 values is finite",
               [&] { read_image(scratch.put("n.nrrd", nrrd("float", packed(std::vector<float>(8, nan))))); });
}

TEST(ImageAxes, ALittleOffAreMadeRightAngledAndSaid) {
  const Scratch scratch;
  const std::string voxels(8, '\1');
  Said said;
  const auto path = scratch.put("a.nii", nifti(2, 8, voxels, 0.06));
  const ImageGrid grid = read_image(path, said.options).grid;
  EXPECT_LT(degrees_off(grid), 1e-9);
  ASSERT_EQ(said.lines.size(), 1U);
  EXPECT_EQ(said.lines[0],
            path.string() +
                ": its axes are 0.06 degrees off right angles: taken as right-angled, which moves its "
                "farthest voxel by 0.00037 mm (resample it onto right-angled voxels if that is too far)");
  // The middle stays, and each axis gives half.
  const auto middle = grid.point(0.5, 0.5, 0.5);
  EXPECT_NEAR(middle[0], -0.5, 1e-5);
  EXPECT_NEAR(middle[1], -0.5 * (1 + std::sin(0.06 * std::numbers::pi / 180)), 1e-5);
  EXPECT_NEAR(std::asin(std::abs(grid.direction[3])) * 180 / std::numbers::pi, 0.03, 1e-4);
  // What a text header rounds is no news.
  read_image(scratch.put("r.nrrd", nrrd("uint8", voxels, "(1,0.00001,0) (0,1,0) (0,0,1)")), said.options);
  EXPECT_EQ(said.lines.size(), 1U);
  read_image(scratch.put("s.nrrd", nrrd("uint8", voxels, "(1,0.001,0) (0,1,0) (0,0,1)")), said.options);
  EXPECT_EQ(said.lines.size(), 2U);
}

// Beyond a tenth of a degree they are resampled, by one line: whatever format says so, labels as labels.
TEST(ImageAxes, FurtherOffAreResampledAndSaid) {
  const Scratch scratch;
  const std::string voxels("\0\0\0\0\x0a\x0a\x0a\x0a", 8);
  const std::string end = " (if the shear means nothing, set the qform of the NIfTI from its sform)";
  Said said;
  const auto nii = scratch.put("a.nii", nifti(2, 8, voxels, 15));
  const Image grey = read_image(nii, said.options);
  EXPECT_LT(degrees_off(grey.grid), 1e-9);
  ASSERT_EQ(said.lines.size(), 1U);
  EXPECT_EQ(said.lines[0],
            nii.string() +
                ": its axes are 15 degrees off right angles: resampled onto right-angled voxels "
                "of 1 x 0.966 x 1 mm, grey values linearly" +
                end);
  const Image labels = read_label_image(nii, said.options);
  ASSERT_EQ(said.lines.size(), 2U);
  EXPECT_NE(said.lines[1].find("labels by the nearest voxel"), std::string::npos);
  EXPECT_EQ(values<std::uint8_t>(labels),
            (std::vector<std::uint8_t>{0, 0, 0, 0, 0, 0, 10, 10, 0, 10, 10, 0}));
  const auto slanted = scratch.put("a.nrrd", nrrd("uint8", voxels, "(1,0.01,0) (0,1,0) (0,0,1)"));
  EXPECT_LT(degrees_off(read_image(slanted, said.options).grid), 1e-9);
  EXPECT_NE(said.lines.back().find("a.nrrd: its axes are 0.573 degrees off right angles: resampled"),
            std::string::npos);
}

TEST(ImageAxes, AbsurdOnesAreOneLineWithARemedy) {
  const Scratch scratch;
  const std::string voxels(8, '\1');
  const std::string mend =
      " degrees off right angles (up to 45 are resampled; of a NIfTI whose shear means nothing, set the "
      "qform "
      "from the sform)";
  expect_error(ErrorKind::data, "a.nii: its axes are not orthonormal: 46" + mend,
               [&] { read_image(scratch.put("a.nii", nifti(2, 8, voxels, 46))); });
  expect_error(ErrorKind::data, "a.nrrd: its axes are not orthonormal: 54.7" + mend,
               [&] { read_image(scratch.put("a.nrrd", nrrd("uint8", voxels, "(1,0,0) (0,1,0) (1,1,1)"))); });
  std::string longer = meta("MET_UCHAR", voxels);
  longer.replace(longer.find("= 1 0 0 0 1 0"), 13, "= 1.2 0 0 0 1 0");
  expect_error(ErrorKind::data, "a.mha: its axes are not orthonormal: the length of one is off by 0.2",
               [&] { read_image(scratch.put("a.mha", longer)); });
  // A row of voxels that would need a plane of them.
  expect_error(ErrorKind::data, "a.nrrd: takes more memory than its", [&] {
    read_image(scratch.put("a.nrrd", nrrd("uint8", voxels, "(1e-6,0,0) (0,1e-6,0) (3e5,3e5,6e5)")));
  });
}

TEST(ImageDicom, SaysWhatItIsAndWhatToDo) {
  const Scratch scratch;
  const std::string slice = std::string(128, '\0') + "DICM" + std::string(64, '\1');
  scratch.put("series/IM000001", slice);
  scratch.put("old/slice.dcm", "no magic");
  scratch.put("other/notes.txt", "x");
  expect_error(ErrorKind::data, "IM000001: does not tell its transfer syntax",
               [&] { read_image(scratch / "series"); });
  expect_error(ErrorKind::data, "old: holds 0 DICOM files, and no slices of an image",
               [&] { read_image(scratch / "old"); });
  expect_error(ErrorKind::data, "slice.dcm: is no DICOM file",
               [&] { read_segmentation(scratch / "old" / "slice.dcm"); });
  expect_error(ErrorKind::data, "other: is a folder without DICOM files, no image",
               [&] { read_image(scratch / "other"); });
  EXPECT_FALSE(is_dicom(scratch / "none"));
}

// An image that gzip packs 1000 to 1 is read up to a limit of its own, that an option moves.
TEST(ImageBudget, PackedImagesAreHeldToIt) {
  const Scratch scratch;
  ImageGrid grid;
  grid.size = {512, 512, 256};
  write_image(scratch / "a.nrrd", Image(grid, ScalarType::u8));
  const auto size = std::filesystem::file_size(scratch / "a.nrrd");
  ASSERT_LT(size, 400000U);
  EXPECT_EQ(read_image(scratch / "a.nrrd").grid.size, grid.size);
  const test::Peak peak = test::peak_of([&] {
    read_image(scratch / "a.nrrd", {files::ReadLimits::of(std::uint64_t{32} << 20), {}});
  });
  EXPECT_NE(peak.error.find("bytes stand for: over "), std::string::npos) << peak.error;
  EXPECT_NE(peak.error.find("allow more by --read-budget MIB"), std::string::npos) << peak.error;
  EXPECT_LT(peak.grown, std::uint64_t{16} << 20);
}

}  // namespace
}  // namespace ecorche::io
