// SPDX-License-Identifier: Apache-2.0
#include "io/surface/volumetric_skeleton_file.hpp"

#include <gtest/gtest.h>

#include <regex>

#include <cmath>
#include <limits>
#include <random>

#include <ecorche/values/volumetric_skeleton_check.hpp>
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

constexpr auto none = VolumetricSkeleton::none;

VolumetricSkeletonFile small() {
  VolumetricSkeletonFile file;
  VolumetricSkeleton& s = file.skeleton;
  s.name = "arm";
  s.grid.size = {9, 8, 30};
  s.grid.origin = {-12.1, 700.3, 1e-3};
  s.grid.spacing = {0.7, 0.7, 0.7};
  s.grid.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  s.thinness = 0.1 + 0.2;
  s.voxel = {{4, 4, 4}, {4, 5, 4}, {4, 4, 9}, {3, 4, 10}, {8, 7, 29}};
  s.distance = {16, 9, 14, 16, 1};
  s.deficit = {0.31F, 0.7F, 1.0F, std::nextafter(1.0F, 2.0F), 0.5F};
  s.parent = {none, 0, 0, 2, none};
  s.segment = {0, 1, 1, none, 2};
  file.segments = {"forearm", "hand", "thumb"};
  file.joints = {{-12.1, 1e6, 0.1 + 0.2}, {0, -700.3, 1e-9}, {1, 2, 3}};
  return file;
}

void expect_equal(const VolumetricSkeletonFile& a, const VolumetricSkeletonFile& b) {
  const VolumetricSkeleton &s = a.skeleton, &t = b.skeleton;
  EXPECT_EQ(s.name, t.name);
  EXPECT_EQ(s.grid, t.grid);
  EXPECT_EQ(s.metric, t.metric);
  EXPECT_EQ(s.thinness, t.thinness);
  EXPECT_EQ(s.voxel, t.voxel);
  EXPECT_EQ(s.distance, t.distance);
  EXPECT_EQ(s.deficit, t.deficit);
  EXPECT_EQ(s.parent, t.parent);
  EXPECT_EQ(s.segment, t.segment);
  EXPECT_EQ(a.segments, b.segments);
  EXPECT_EQ(a.joints, b.joints);
}

TEST(VolumetricSkeletonFile, ComesBackAsItWent) {
  const Scratch scratch;
  std::vector<VolumetricSkeletonFile> files(5, small());
  files[1].skeleton.parent.clear();
  files[1].joints.clear();
  files[2].skeleton.segment.clear();
  files[2].segments.clear();
  files[2].joints.clear();
  files[3].skeleton.metric = DistanceMetric::chamfer345;
  files[3].skeleton.distance = {12, 9, 11, 12, 3};
  files[3].skeleton.parent.assign(5, none);  // a tree without an edge
  files[4].skeleton = VolumetricSkeleton();
  files[4].skeleton.grid.size = {1, 1, 1};
  for (const VolumetricSkeletonFile& file : files) {
    write_volumetric_skeleton(scratch / "s.vtp", file);
    expect_equal(read_volumetric_skeleton(scratch / "s.vtp"), file);
    const std::string bytes = scratch.get("s.vtp");
    write_volumetric_skeleton(scratch / "s.vtp", file);
    EXPECT_EQ(scratch.get("s.vtp"), bytes);
  }
}

TEST(VolumetricSkeletonFile, EveryPrefixAndEveryFlippedBitIsRefusedOrSound) {
  const Scratch scratch;
  write_volumetric_skeleton(scratch / "s.vtp", small());
  const std::string good = scratch.get("s.vtp");
  const std::size_t whole = good.rfind("\n</AppendedData>");
  for (std::size_t size = 0; size < whole; ++size) {
    EXPECT_THROW(decode_volumetric_skeleton(std::string_view(good).substr(0, size), "s.vtp"), Error) << size;
  }
  std::size_t refused = 0;
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::string bad = good;
    bad[bit / 8] = static_cast<char>(bad[bit / 8] ^ (1 << bit % 8));
    try {
      const VolumetricSkeletonFile file = decode_volumetric_skeleton(bad, "s.vtp");
      EXPECT_EQ(first_defect(file.skeleton), "");
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::data) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, good.size());
}

TEST(VolumetricSkeletonFile, RefusesWhatContradictsItself) {
  const Scratch scratch;
  write_volumetric_skeleton(scratch / "s.vtp", small());
  const std::string good = scratch.get("s.vtp");
  const auto swapped = [&](const std::string& from, const std::string& to) {
    std::string bad = good;
    const std::size_t at = bad.find(from);
    EXPECT_NE(at, bad.npos) << from;
    return bad.replace(at, from.size(), to);
  };
  const auto refuses = [&](const std::string& part, const std::string& bytes) {
    expect_error(ErrorKind::data, part, [&] { decode_volumetric_skeleton(bytes, "s.vtp"); });
  };
  refuses("no field 'ecorche_volumetric_skeleton'", swapped("\"ecorche_volumetric_skeleton\"", "\"other\""));
  refuses("is of version 2 (this program reads version 1)",
          swapped("format=\"ascii\">1 <", "format=\"ascii\">2 <"));
  refuses("not where its 'ijk' says", swapped("-12.1 700.3", "-12.1 701.3"));
  refuses("isotropic", swapped("0.7 0.7 0.7", "0.7 0.7 0.8"));
  refuses("orthonormal", swapped("0 -1 0 1 0 0 0 0 1", "0 -1 0 1 0 0 0 1 1"));
  refuses("'size' holds 70000", swapped("9 8 30", "70000 8 30"));
  refuses("of the grid's border", swapped("9 8 30", "9 7 30"));
  refuses("has lines, but says that it has no tree",
          swapped("Name=\"tree\" NumberOfTuples=\"1\" format=\"ascii\">1",
                  "Name=\"tree\" NumberOfTuples=\"1\" format=\"ascii\">0"));
  refuses("no point array 'distance'", swapped("Name=\"distance\"", "Name=\"distant\""));
  refuses("for 6 voxels", swapped("NumberOfPoints=\"5\"", "NumberOfPoints=\"6\""));
  refuses("more than the file can hold", swapped("NumberOfPoints=\"5\"", "NumberOfPoints=\"5555555555\""));
  refuses("has a DOCTYPE", "<!DOCTYPE x>" + good);
  const auto field = [&](const std::string& name, const std::string& text) {
    return std::regex_replace(good, std::regex("(Name=\"" + name + "\"[^>]*>)[^<]*"), "$01" + text + " ");
  };
  const auto array = [&](const std::string& name, const std::string& text) {
    return std::regex_replace(good, std::regex("(<DataArray[^>]*Name=\"" + name + "\")[^>]*/>"),
                              "$1 format=\"ascii\">" + text + "</DataArray>");
  };
  refuses("its field 'size' has not 3 values", field("size", "9 8"));
  refuses("its field 'joints' has not 9 values", field("joints", "1 2 3 4 5 6"));
  refuses("its field 'joints' holds 1e+07", field("joints", "1 2 3 4 1e7 6 7 8 9"));
  refuses("its field 'joints' holds nan", field("joints", "1 2 3 4 nan 6 7 8 9"));
  refuses("its field 'tree' is neither 0 nor 1", field("tree", "2"));
  refuses("its metric is 'taxicab'", field("metric", "116 97 120 105 99 97 98 0"));
  refuses("its field 'metric' is not of 1 strings at most", field("metric", "97 0 98 0"));
  refuses("has no point array 'deficit'", swapped("Name=\"deficit\"", "Name=\"defect\""));
  refuses("its array 'deficit' holds nan", array("deficit", "1 2 nan 1 1"));
  refuses("its array 'distance' has 4 values for 5 voxels", array("distance", "1 2 1 1"));
  refuses("its array 'distance' holds 0", array("distance", "1 2 0 1 1"));
  refuses("its lines have no array 'offsets'", swapped("Name=\"offsets\"", "Name=\"ends\""));
  refuses("its lines' array 'offsets' has not 3 values", array("offsets", "2 4"));
  refuses("its line 1 does not join two voxels", array("offsets", "2 5 6"));
  refuses("is no VTK PolyData", "<VTKFile type=\"ImageData\"/>");
  expect_error(ErrorKind::missing_input, "none.vtp", [&] { read_volumetric_skeleton(scratch / "none.vtp"); });
  expect_error(ErrorKind::usage, "ends in .vtp",
               [&] { write_volumetric_skeleton(scratch / "s.txt", small()); });
}

TEST(VolumetricSkeletonFile, ADamagedOneIsNotWritten) {
  const Scratch scratch;
  VolumetricSkeletonFile file = small();
  file.skeleton.distance.pop_back();
  const auto error = error_of([&] { write_volumetric_skeleton(scratch / "s.vtp", file); });
  EXPECT_EQ(error->problem(), first_defect(file.skeleton));
  EXPECT_EQ(error->mend(), "report how it was thinned");
  EXPECT_FALSE(std::filesystem::exists(scratch / "s.vtp"));
}

TEST(VolumetricSkeletonCheck, FindsEveryDefect) {
  const auto defect = [](auto&& change) {
    VolumetricSkeleton s = small().skeleton;
    change(s);
    return first_defect(s);
  };
  const auto finds = [&](const std::string& part, auto&& change) {
    EXPECT_NE(defect(change).find(part), std::string::npos) << part << ", got: " << defect(change);
  };
  using S = VolumetricSkeleton;
  EXPECT_EQ(defect([](S&) {}), "");
  finds("voxels along an axis", [](S& s) { s.grid.size[1] = 0; });
  finds("voxels along an axis", [](S& s) { s.grid.size[1] = 65536; });
  finds("origin", [](S& s) { s.grid.origin[2] = std::nan(""); });
  finds("positive", [](S& s) { s.grid.spacing = {-1, -1, -1}; });
  finds("isotropic", [](S& s) { s.grid.spacing[0] = 0.71; });
  finds("orthonormal", [](S& s) { s.grid.direction[0] = 0.5; });
  finds("thinness", [](S& s) { s.thinness = std::numeric_limits<double>::infinity(); });
  finds("one entry", [](S& s) { s.distance.pop_back(); });
  finds("one entry", [](S& s) { s.deficit.push_back(1); });
  finds("one entry", [](S& s) { s.parent.pop_back(); });
  finds("one entry", [](S& s) { s.segment.pop_back(); });
  finds("row 4 lies outside", [](S& s) { s.voxel[4][2] = 30; });
  finds("row 1 is not behind", [](S& s) { s.voxel[1] = s.voxel[0]; });
  finds("row 0 has the distance 17", [](S& s) { s.distance[0] = 17; });  // 4 from the border in y
  finds("row 4 has the distance 0", [](S& s) { s.distance[4] = 0; });
  finds("row 0 has the distance 13", [](S& s) {
    s.metric = DistanceMetric::chamfer345;
    s.distance = {13, 9, 11, 12, 3};
  });
  finds("row 2 has a deficit", [](S& s) { s.deficit[2] = std::nanf(""); });
  finds("row 0 has a deficit", [](S& s) { s.deficit[0] = 0.3F - 1e-6F; });
  finds("row 3 has the parent 5", [](S& s) { s.parent[3] = 5; });
  finds("row 3 has the parent -2", [](S& s) { s.parent[3] = -2; });
  finds("among its parents", [](S& s) { s.parent = {3, 0, 1, 2, none}; });
  finds("among its parents", [](S& s) { s.parent[4] = 4; });
  finds("row 1 has the segment -2", [](S& s) { s.segment[1] = -2; });
}

}  // namespace
}  // namespace ecorche::io
