// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/error.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche {
namespace {

TEST(Error, IsOneLineWithWhereWhatAndMend) {
  const Error error(ErrorKind::config, "case.yaml:3:skin", "no such\nfile", "check the path");
  EXPECT_STREQ(error.what(), "case.yaml:3:skin: no such file (check the path)");
  EXPECT_EQ(error.mend(), "check the path");
}

TEST(Image, OnlyWholeNumbersAreCounted) {
  ImageGrid grid;
  grid.size = {1, 1, 1};
  try {
    distinct_values(Image(grid, ScalarType::f32), 5);
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "image: its voxels are no whole numbers (report this)");
  }
}

TEST(Error, KindsHaveTheirExitCodes) {
  const std::pair<ErrorKind, int> expected[] = {
      {ErrorKind::usage, 64},     {ErrorKind::data, 65},          {ErrorKind::missing_input, 66},
      {ErrorKind::internal, 70},  {ErrorKind::cannot_create, 73}, {ErrorKind::io, 74},
      {ErrorKind::temporary, 75}, {ErrorKind::protocol, 76},      {ErrorKind::refused, 77},
      {ErrorKind::config, 78},    {ErrorKind::interrupted, 130}};
  for (const auto& [kind, code] : expected) EXPECT_EQ(exit_code(kind), code);
}

TEST(Error, BecomesAStatusOfTheWire) {
  EXPECT_EQ(to_status(Error(ErrorKind::data, "a", "b", "c")).code, StatusCode::invalid_argument);
  EXPECT_EQ(to_status(Error(ErrorKind::io, "a", "b", "c")).code, StatusCode::internal);
}

TEST(Context, StopIsAnError) {
  std::stop_source source;
  Context context;
  context.check_stop();
  context.stop = source.get_token();
  context.check_stop();
  source.request_stop();
  EXPECT_THROW(context.check_stop(), Error);
}

TEST(ImageGrid, PointAndIndexAreInverse) {
  ImageGrid grid;
  grid.size = {4, 5, 6};
  grid.spacing = {0.5, 2, 3};
  grid.origin = {10, -20, 30};
  grid.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};  // i runs along +y, j along -x
  const auto p = grid.point(1, 2, 3);
  EXPECT_DOUBLE_EQ(p[0], 10 - 4);
  EXPECT_DOUBLE_EQ(p[1], -20 + 0.5);
  EXPECT_DOUBLE_EQ(p[2], 39);
  const auto index = grid.index(p);
  for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(index[a], static_cast<double>(a + 1), 1e-12);
}

TEST(Image, ScalarsOfAnotherTypeAreRefused) {
  ImageGrid grid;
  grid.size = {2, 2, 2};
  Image image(grid, ScalarType::i16, 3);
  EXPECT_EQ(image.scalars<std::int16_t>().size(), 24u);
  EXPECT_THROW(image.scalars<float>(), Error);
}

TEST(Group, NamesRoundTripAndOthersAreRefused) {
  for (int g = 0; g <= static_cast<int>(Group::other); ++g) {
    EXPECT_EQ(group_from_name(group_name(static_cast<Group>(g))), static_cast<Group>(g));
  }
  EXPECT_THROW(group_from_name("bones"), Error);
}

TEST(RigidTransform, ComposesParentFirstAndInverts) {
  const RigidTransform a{Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ())), {1, 2, 3}};
  const RigidTransform b{Eigen::Quaterniond(Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitX())), {4, 5, 6}};
  const Eigen::Vector3d x(7, 8, 9);
  EXPECT_TRUE(((a * b) * x).isApprox(a * (b * x), 1e-14));
  EXPECT_TRUE((a.inverse() * (a * x)).isApprox(x, 1e-14));
}

}  // namespace
}  // namespace ecorche
