// SPDX-License-Identifier: Apache-2.0
// The examples of docs/reference are read by the readers that they describe.
#include <gtest/gtest.h>

#include <ecorche/io/case_file.hpp>
#include "io/case/attachment_file.hpp"
#include "io/image/image_file.hpp"
#include "io/surface/surface_file.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::io {
namespace {

// The first block of YAML after the heading that begins with `first`.
std::string example(const std::string& heading, const char* of = "case.md", const std::string& first = "") {
  std::ifstream file(std::string(ECORCHE_SOURCE "/docs/reference/") + of, std::ios::binary);
  const std::string page(std::istreambuf_iterator<char>(file), {});
  const std::size_t at = page.find("## " + heading), begin = page.find("```yaml\n" + first, at) + 8;
  EXPECT_NE(at, page.npos) << heading;
  return page.substr(begin, page.find("```", begin) - begin);
}

TEST(Docs, TheExamplesAreRead) {
  const Scratch scratch;
  scratch.put("case.yaml", example("case.yaml"));
  scratch.put("skeleton.yaml", example("skeleton.yaml", "skeleton.md"));
  scratch.put("regions.yaml", example("Regions", "skeleton.md", "ecorche_regions"));
  for (const char* folder : {"bones", "muscles"}) std::filesystem::create_directory(scratch / folder);
  const Case small = small_case();
  for (const char* file : {"skin.stl", "bones/hip.stl", "bones/femur.stl", "muscles/rf.stl"})
    write_surface(scratch / file, small.skin);
  write_image(scratch / "ct.nrrd", small.volumes[0].image);
  write_image(scratch / "seg.nrrd", small.labels->image);
  const Case patient = read_case(scratch.path(), {}, Context{});
  EXPECT_EQ(patient.bones.size(), 2u);
  EXPECT_EQ(patient.bones[1].surface.V.row(0), Eigen::RowVector3d(500, 400, -1000));  // RAS, cm
  EXPECT_EQ(patient.skeleton.segments.size(), 3u);
  ASSERT_EQ(patient.regions.size(), 5u);
  EXPECT_EQ(patient.regions[0].points.row(3), patient.bones[1].surface.V.row(7));
  Rig rig;
  rig.skeleton = patient.skeleton;
  const Pose pose = read_pose(scratch.put("pose.yaml", example("pose.yaml", "pose.md")), rig);
  const Reassignment by_hand =
      read_attachment(scratch.put("by_hand.yaml", example("Joints", "volumetric.md")), patient.skeleton);
  EXPECT_EQ(by_hand.splits.at(0).within_mm, 120);
  EXPECT_EQ(by_hand.regions.at(0).from, "thigh_right");
  EXPECT_EQ(by_hand.regions.at(1).radius, 60);
  EXPECT_NEAR(2 * std::acos(pose.rotation[2].w()), std::acos(0.0), 1e-12);  // the knee at 90 degrees
}

}  // namespace
}  // namespace ecorche::io
