// SPDX-License-Identifier: Apache-2.0
// Images whose axes lean: resampled onto right-angled voxels. The oracle is a ball and a slope in the world.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "io/image/image_file.hpp"
#include "io/image/mask_folder.hpp"
#include "io/image/right_angles.hpp"
#include "io/image/unsheared.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kRadius = 14;
const Vector3d kCenter(3, -5, 8), kSlope(2, -1, 3);

// Turned, and then each axis leans as the columns of `shear` say.
ImageGrid leaning(const Matrix3d& shear, const std::array<double, 3>& spacing, bool left_handed = false) {
  Matrix3d axes = Eigen::AngleAxisd(0.4, Vector3d(1, 2, -1).normalized()).toRotationMatrix() * shear;
  if (left_handed) axes.col(1) *= -1;
  ImageGrid grid;
  Vector3d middle = Vector3d::Zero();
  for (Eigen::Index a = 0; a < 3; ++a) {
    const auto k = static_cast<std::size_t>(a);
    grid.size[k] = static_cast<int>(56 / spacing[k]);
    grid.spacing[k] = spacing[k] * axes.col(a).norm();
    for (Eigen::Index row = 0; row < 3; ++row)
      grid.direction[static_cast<std::size_t>(3 * row + a)] = axes(row, a) / axes.col(a).norm();
    middle += axes.col(a) * spacing[k] * (grid.size[k] - 1) / 2;
  }
  for (std::size_t k = 0; k < 3; ++k) grid.origin[k] = (kCenter - middle)[static_cast<Eigen::Index>(k)];
  return grid;
}

// `of` the place of each voxel.
template <class T, class F>
Image drawn(const ImageGrid& grid, F&& of) {
  Image image(grid, scalar_type_of<T>);
  const auto voxels = image.scalars<T>();
  std::size_t at = 0;
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i, ++at) {
        const auto p = grid.point(i, j, k);
        voxels[at] = static_cast<T>(of(Vector3d(p[0], p[1], p[2])));
      }
  return image;
}

int ball(const Vector3d& p) {
  return (p - kCenter).norm() < kRadius ? 7 : 0;
}

Matrix3d shear_of(double jx, double kx, double ky) {
  Matrix3d out = Matrix3d::Identity();
  out(0, 1) = jx, out(0, 2) = kx, out(1, 2) = ky;
  return out;
}

Matrix3d turned_around(const Matrix3d& shear) {  // the first axis leans on the others
  Matrix3d out;
  out.col(0) = shear.col(2).reverse(), out.col(1) = shear.col(1).reverse(),
  out.col(2) = shear.col(0).reverse();
  return out;
}

const std::vector<ImageGrid>& grids() {
  static const std::vector<ImageGrid> all{
      leaning(shear_of(0, 0, 0.36), {1, 1, 2}),
      leaning(shear_of(0, 0.3, -0.2), {0.8, 1.1, 2.5}),
      leaning(shear_of(0.2, 0.1, 0.3), {1, 1.2, 0.9}),
      leaning(turned_around(shear_of(0, 0.23, 0.33)), {2, 1, 1}),
      leaning(shear_of(0, -0.5, 0.5), {1, 1, 2.9}, true),
      leaning(shear_of(0.01, 0, 0), {1.5, 1.5, 1.5}),
  };
  return all;
}

// Every voxel centre of the result has the label of the ball, but within half a voxel's diagonal of its
// border.
TEST(Sheared, LabelsOfABallStayWhereTheyAre) {
  for (const ImageGrid& grid : grids()) {
    Said said;
    Image image = drawn<std::uint16_t>(grid, ball);
    const double volume = static_cast<double>(
        std::count(image.scalars<std::uint16_t>().begin(), image.scalars<std::uint16_t>().end(), 7));
    make_unsheared(image, VoxelKind::labels, "a.nii.gz", said.options);
    ASSERT_LT(degrees_off(image.grid), 1e-9);
    for (std::size_t a = 0; a < 3; ++a) EXPECT_LE(image.grid.spacing[a], grid.spacing[a] * (1 + 1e-9));
    const auto voxels = image.scalars<std::uint16_t>();
    const double most = 0.5 * std::hypot(grid.spacing[0], grid.spacing[1], grid.spacing[2]);
    std::size_t at = 0, wrong = 0, inside = 0;
    Vector3d middle = Vector3d::Zero();
    for (int k = 0; k < image.grid.size[2]; ++k)
      for (int j = 0; j < image.grid.size[1]; ++j)
        for (int i = 0; i < image.grid.size[0]; ++i, ++at) {
          const auto p = image.grid.point(i, j, k);
          const Vector3d place(p[0], p[1], p[2]);
          const double depth = kRadius - (place - kCenter).norm();
          if (voxels[at] != 0 && voxels[at] != 7) ++wrong;
          if (std::abs(depth) > most && (voxels[at] == 7) != (depth > 0)) ++wrong;
          if (voxels[at] == 7) ++inside, middle += place;
        }
    EXPECT_EQ(wrong, 0U);
    EXPECT_NEAR(static_cast<double>(inside) / volume, 1, 0.01) << "a voxel holds as much as before";
    EXPECT_LT((middle / static_cast<double>(inside) - kCenter).norm(), 0.05);
    ASSERT_EQ(said.lines.size(), 1U);
    EXPECT_NE(said.lines[0].find("labels by the nearest voxel"), std::string::npos) << said.lines[0];
  }
}

// A slope is linear, so that linear interpolation gives it back; outside of all voxels stands the least
// value.
TEST(Sheared, GreyValuesAreInterpolated) {
  for (const ImageGrid& grid : grids()) {
    Said said;
    Image image = drawn<float>(grid, [](const Vector3d& p) { return kSlope.dot(p); });
    const auto before = image.scalars<float>();
    const float least = *std::min_element(before.begin(), before.end());
    const std::size_t all = before.size();
    make_unsheared(image, VoxelKind::grey, "a.nii.gz", said.options);
    const auto voxels = image.scalars<float>();
    std::size_t at = 0, held = 0;
    const double rim = kSlope.norm() * *std::max_element(grid.spacing.begin(), grid.spacing.end());
    for (int k = 0; k < image.grid.size[2]; ++k)
      for (int j = 0; j < image.grid.size[1]; ++j)
        for (int i = 0; i < image.grid.size[0]; ++i, ++at) {
          const auto p = image.grid.point(i, j, k);
          const double truth = kSlope.dot(Vector3d(p[0], p[1], p[2]));
          if (std::abs(voxels[at] - truth) < 1e-3)
            ++held;
          else
            EXPECT_TRUE(voxels[at] == least || std::abs(voxels[at] - truth) < rim)
                << i << " " << j << " " << k;
        }
    EXPECT_GT(static_cast<double>(held), 0.9 * static_cast<double>(all));
    ASSERT_EQ(said.lines.size(), 1U);
    EXPECT_NE(said.lines[0].find("grey values linearly"), std::string::npos) << said.lines[0];
  }
}

// Every voxel of a stack that leans along whole voxels finds itself again, to the last bit, and none is lost.
TEST(Sheared, WholeShiftsLoseNothing) {
  const ImageGrid grid = leaning(shear_of(0, 0.5, -1.0 / 2), {1, 1, 2});
  std::int16_t next = -1000;
  Image image = drawn<std::int16_t>(
      grid, [&](const Vector3d&) { return next = static_cast<std::int16_t>(next % 3000 + 1); });
  const Image before = image;
  Said said;
  make_unsheared(image, VoxelKind::grey, "a.nii.gz", said.options);
  EXPECT_EQ(image.grid.size[0], grid.size[0] + grid.size[2] - 1);
  EXPECT_EQ(image.grid.size[2], grid.size[2]);
  std::size_t lost = 0;
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto at = image.grid.index(grid.point(i, j, k));
        const std::size_t to =
            image.grid.offset(static_cast<int>(std::lround(at[0])), static_cast<int>(std::lround(at[1])),
                              static_cast<int>(std::lround(at[2])));
        lost +=
            image.scalars<std::int16_t>()[to] == before.scalars<std::int16_t>()[grid.offset(i, j, k)] ? 0 : 1;
      }
  EXPECT_EQ(lost, 0U);
}

TEST(Sheared, RightAngledImagesAreLeftAlone) {
  Said said;
  Image image = drawn<std::uint8_t>(leaning(Matrix3d::Identity(), {1, 2, 3}), ball);
  const Image before = image;
  make_unsheared(image, VoxelKind::labels, "a.nii.gz", said.options);
  EXPECT_EQ(image.grid, before.grid);
  EXPECT_EQ(image.bytes, before.bytes);
  EXPECT_TRUE(said.lines.empty());
}

// Three axes at 62 degrees from each other nearly lie in one plane, though each pair may do.
TEST(Sheared, TheThirdAxisCountsFromTheNormal) {
  EXPECT_NEAR(lean_degrees(leaning(shear_of(0, 0, 1), {1, 1, 1})), 45, 1e-6);
  EXPECT_NEAR(lean_degrees(leaning(shear_of(0, 1, 1), {1, 1, 1})),
              std::atan(std::sqrt(2)) * 180 / std::numbers::pi, 1e-6);
  EXPECT_LT(lean_degrees(leaning(Matrix3d::Identity(), {1, 2, 3})), 1e-5);
}

}  // namespace
}  // namespace ecorche::io
