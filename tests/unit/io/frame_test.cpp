// SPDX-License-Identifier: Apache-2.0
// Frames and units at the edge.
#include <gtest/gtest.h>

#include <set>

#include <ecorche/io/case_file.hpp>
#include "io/case/frame.hpp"
#include "io/surface/surface_file.hpp"
#include "preprocess/check/surface_figures.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::io {
namespace {

using Eigen::Vector3d;

TEST(Frame, ThereAre48Codes) {
  const std::string letters = "LRPASIX";
  std::set<std::string> seen;
  for (const char a : letters) {
    for (const char b : letters) {
      for (const char c : letters) {
        const std::string code{a, b, c};
        const auto axes = axes_from_code(code);
        if (!axes) continue;
        seen.insert(code);
        EXPECT_TRUE((axes->transpose() * *axes).isIdentity(0)) << code;
      }
    }
  }
  EXPECT_EQ(seen.size(), 48u);
  for (const char* wrong : {"", "LP", "LPSS", "lps", "LRS", "LPA"})
    EXPECT_FALSE(axes_from_code(wrong)) << wrong;
}

// x to the left, y superior, z anterior, in cm: left is +x, superior +z, anterior -y of LPS.
TEST(Frame, LsaInCentimetresByHand) {
  Frame frame{*axes_from_code("LSA"), *unit_from_name("cm")};
  EXPECT_EQ(frame.point({1, 2, 3}), Vector3d(10, -30, 20));
  EXPECT_FALSE(frame.left_handed());
  frame.axes = *axes_from_code("RAS");
  EXPECT_EQ(frame.point({1, 2, 3}), Vector3d(-10, -20, 30));
  EXPECT_TRUE(Frame{*axes_from_code("LAS")}.left_handed());
}

// A box that looks outward by the numbers of its file does so in LPS too, also where the file's frame
// mirrors.
TEST(Frame, OutwardStaysOutward) {
  for (const char* code : {"LPS", "RAS", "LAS", "RPS", "LPI", "SAL", "ASL"}) {
    const Frame frame{*axes_from_code(code), 10};
    SurfaceMesh mesh = box({1, 2, 3}, {2, 4, 7});
    frame.apply(mesh);
    EXPECT_NEAR(check::measure(mesh).volume_mm3, 8000, 1e-6) << code;
  }
}

class FramesOfACase : public ::testing::Test {
 protected:
  FramesOfACase() { write_case(scratch_.path(), small_case(), context_); }
  Case read(const std::string& frame, const std::string& skin, const CaseOptions& options = {}) {
    const std::string bones =
        "bones:\n  - {name: pelvis_bone, file: bones/pelvis_bone.stl, segment: pelvis}\n";
    return read_case(scratch_.put("case.yaml", "name: a\n" + frame +
                                                   "skeleton: skeleton.yaml\nskin: " + skin + "\n" + bones),
                     options, context_);
  }
  // Gives skin.stl another tag in its header.
  void tag(const std::string& space) {
    std::string bytes = scratch_.get("skin.stl");
    bytes.replace(bytes.find("SPACE=LPS"), 9, space);
    scratch_.put("skin.stl", bytes);
  }

  Scratch scratch_;
  std::vector<std::string> warnings_;
  Context context_{.progress = {},
                   .log =
                       [this](LogLevel, std::string_view line) {
                         if (line.find(":skin") != line.npos) warnings_.emplace_back(line);
                       },
                   .stop = {}};
  const Vector3d corner_ = small_case().skin.V.row(0).transpose();
};

TEST_F(FramesOfACase, TheNearestWordWins) {
  const auto first = [](const Case& patient) { return Vector3d(patient.skin.V.row(0).transpose()); };
  const Vector3d ras(-corner_.x(), -corner_.y(), corner_.z()), lsa(corner_.x(), -corner_.z(), corner_.y());
  tag("         ");
  EXPECT_EQ(first(read("", "skin.stl")), corner_);
  EXPECT_EQ(first(read("frame: RAS\n", "skin.stl")), ras);
  EXPECT_EQ(first(read("frame: RAS\n", "{file: skin.stl, frame: LSA}")), lsa);
  EXPECT_EQ(first(read("frame: RAS\n", "skin.stl", {.data = {}, .frame = "LSA"})), lsa);
  EXPECT_EQ(first(read("unit: cm\n", "skin.stl")), 10 * corner_);
  EXPECT_EQ(first(read("unit: cm\n", "{file: skin.stl, unit: m}")), 1000 * corner_);
  EXPECT_TRUE(warnings_.empty());
  scratch_.put("skin.stl", "SPACE=RAS" + scratch_.get("skin.stl").substr(9));
  EXPECT_EQ(first(read("", "skin.stl")), ras);
  EXPECT_TRUE(warnings_.empty());
  EXPECT_EQ(first(read("frame: LPS\n", "skin.stl")), corner_);
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_NE(warnings_[0].find(":4:skin: its header says SPACE=RAS, which the given frame overrides"),
            std::string::npos);
  expect_error(ErrorKind::usage, "--frame: 'XYZ' is no frame",
               [&] { read("", "skin.stl", {.data = {}, .frame = "XYZ"}); });
}

TEST_F(FramesOfACase, GltfIsMetresLeftUpForwardUnlessItsEntrySaysOtherwise) {
  const SurfaceMesh skin = small_case().skin;
  write_surface(scratch_ / "skin.glb", skin);
  const auto off = [&](const std::string& frame, const std::string& entry) {
    return (read(frame, entry).skin.V - skin.V).cwiseAbs().maxCoeff();
  };
  EXPECT_LT(off("", "skin.glb"), 1e-3);
  EXPECT_LT(off("frame: RAS\nunit: cm\n", "skin.glb"), 1e-3);
  EXPECT_LT(off("", "{file: skin.glb, frame: LSA, unit: 1000}"), 1e-3);
  const SurfaceMesh millimetres = read("", "{file: skin.glb, unit: mm}").skin;
  EXPECT_LT((1000 * millimetres.V - skin.V).cwiseAbs().maxCoeff(), 1e-3);
  const SurfaceMesh right = read("", "{file: skin.glb, frame: RSA}").skin;
  EXPECT_LT((right.V.col(0) + skin.V.col(0)).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_EQ(right.F.col(1), skin.F.col(2));  // left-handed
}

TEST_F(FramesOfACase, UnitsAreNamedOrNumbers) {
  tag("         ");
  for (const auto& [unit, millimetres] :
       {std::pair("um", 1e-3), {"mm", 1.0}, {"cm", 10.0}, {"m", 1e3}, {"in", 25.4}, {"2.5", 2.5}}) {
    EXPECT_EQ(Vector3d(read("unit: " + std::string(unit) + "\n", "skin.stl").skin.V.row(0).transpose()),
              millimetres * corner_);
  }
  for (const char* unit : {"0", "-1", "nan", "1e99", "25.4mm"})
    expect_error(ErrorKind::config, "is no unit",
                 [&] { read("unit: " + std::string(unit) + "\n", "skin.stl"); });
}

TEST_F(FramesOfACase, CentresAndAxesOfTheSkeletonToo) {
  scratch_.put("skeleton.yaml",
               "ecorche_skeleton: 1\nname: a\nsegments:\n  pelvis:\n    joint: {name: root, center: [1, 2, "
               "3], axes: {x: [0, 1, 0], y: [0, 0, 1]}}\n");
  const Joint joint = read("frame: LSA\nunit: cm\n", "skin.stl").skeleton.segments[0].joint;
  EXPECT_EQ(joint.center, Vector3d(10, -30, 20));
  EXPECT_EQ(joint.axes.col(0), Vector3d(0, 0, 1));
  EXPECT_EQ(joint.axes.col(1), Vector3d(0, -1, 0));
  EXPECT_EQ(joint.axes.col(2), Vector3d(1, 0, 0));
}

}  // namespace
}  // namespace ecorche::io
