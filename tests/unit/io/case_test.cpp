// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <ecorche/io/case_file.hpp>
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::io {
namespace {

TEST(Case, WrittenAndReadIsTheSame) {
  const Scratch scratch;
  const Case patient = small_case();
  write_case(scratch.path(), patient, Context{});
  const Case back = read_case(scratch / "case.yaml", {}, Context{});
  EXPECT_EQ(back.name, patient.name);
  EXPECT_EQ(back.skin_name, patient.skin_name);
  EXPECT_EQ(back.skin.V, patient.skin.V);
  EXPECT_EQ(back.skin.F, patient.skin.F);
  ASSERT_EQ(back.bones.size(), 2u);
  EXPECT_EQ(back.bones[1].name, "femur_right");
  EXPECT_EQ(back.bones[1].segment, "thigh_right");
  EXPECT_EQ(back.bones[1].surface.V, patient.bones[1].surface.V);
  ASSERT_EQ(back.tissues.size(), 1u);
  EXPECT_EQ(static_cast<int>(back.tissues[0].group), static_cast<int>(Group::muscle));
  ASSERT_EQ(back.volumes.size(), 1u);
  EXPECT_EQ(back.volumes[0].background, -1024);
  EXPECT_EQ(back.volumes[0].image.bytes, patient.volumes[0].image.bytes);
  EXPECT_EQ(back.volumes[0].image.grid, patient.volumes[0].image.grid);
  ASSERT_TRUE(back.labels);
  EXPECT_EQ(back.labels->table, patient.labels->table);
  EXPECT_EQ(back.labels->image.bytes, patient.labels->image.bytes);
  EXPECT_EQ(skeleton_to_yaml(back.skeleton), skeleton_to_yaml(patient.skeleton));
  EXPECT_EQ(back.input_digests.size(), 8u);
  EXPECT_TRUE(back.input_digests.contains("bones/femur_right.stl"));
}

}  // namespace
}  // namespace ecorche::io
