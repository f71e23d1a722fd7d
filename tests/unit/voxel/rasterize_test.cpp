// SPDX-License-Identifier: Apache-2.0
// The parts of the voxelizer, against slow and obvious twins.
#include "preprocess/voxel/rasterize.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "preprocess/voxel/open_surface.hpp"
#include "tests/unit/voxel/shapes.hpp"

namespace ecorche::voxel {
namespace {

using Big = std::array<std::int64_t, 3>;

Big cross(const Big& a, const Big& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
std::int64_t dot(const Big& a, const Big& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// The textbook: two convex bodies are apart when one of thirteen axes keeps their shadows apart.
bool overlap_by_all_axes(const Vec3i (&t)[3], const Vec3i& voxel) {
  std::vector<Big> axes{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Big edge[3];
  for (std::size_t e = 0; e < 3; ++e)
    for (std::size_t a = 0; a < 3; ++a) edge[e][a] = t[(e + 1) % 3][a] - t[e][a];
  axes.push_back(cross(edge[0], edge[1]));
  for (const Big& e : edge)
    for (std::size_t a = 0; a < 3; ++a) axes.push_back(cross(e, axes[a]));
  for (const Big& axis : axes) {
    std::int64_t low = INT64_MAX, high = INT64_MIN, box_low = INT64_MAX, box_high = INT64_MIN;
    for (const Vec3i& p : t) {
      const std::int64_t at = dot(axis, {p[0], p[1], p[2]});
      low = std::min(low, at);
      high = std::max(high, at);
    }
    for (int corner = 0; corner < 8; ++corner) {
      const std::int64_t at = dot(axis, {std::int64_t{units} * (voxel[0] + (corner & 1)),
                                         std::int64_t{units} * (voxel[1] + (corner >> 1 & 1)),
                                         std::int64_t{units} * (voxel[2] + (corner >> 2))});
      box_low = std::min(box_low, at);
      box_high = std::max(box_high, at);
    }
    if (high < box_low || box_high < low) return false;
  }
  return true;
}

TEST(TriangleBox, EqualsAllThirteenAxes) {
  std::mt19937 random(7);
  int hits = 0, misses = 0;
  for (int n = 0; n < 20000; ++n) {
    const int spread = n % 3 == 0 ? 2 * units : 4 * units;
    Vec3i t[3];
    for (Vec3i& p : t)
      for (std::int32_t& x : p) x = static_cast<std::int32_t>(random() % static_cast<unsigned>(spread)) | 1;
    if (n % 7 == 0) t[2] = t[1];                           // a segment
    if (n % 11 == 0) t[0][2] = t[1][2] = t[2][2];          // axis-parallel
    if (n % 13 == 0) t[0][2] = t[1][2] = t[2][2] = units;  // along voxel faces
    const TriangleBoxTest fast(t[0], t[1], t[2]);
    Vec3i low, high;
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min({t[0][a], t[1][a], t[2][a]}) / units;
      high[a] = std::max({t[0][a], t[1][a], t[2][a]}) / units;
    }
    for (int k = low[2]; k <= high[2]; ++k)
      for (int j = low[1]; j <= high[1]; ++j)
        for (int i = low[0]; i <= high[0]; ++i) {
          const bool truth = overlap_by_all_axes(t, {i, j, k});
          ASSERT_EQ(fast.overlaps(i, j, k), truth) << n << ": voxel " << i << " " << j << " " << k;
          ++(truth ? hits : misses);
        }
  }
  EXPECT_GT(hits, 10000);
  EXPECT_GT(misses, 10000);
}

ImageGrid unit_grid(int n) {
  ImageGrid grid;
  grid.size = {n, n, n};
  grid.origin = {0.5, 0.5, 0.5};  // voxel i is [i, i + 1]
  return grid;
}

std::array<int, 2> extent(const VoxelMask& mask, std::uint8_t bits, std::size_t axis) {
  std::array<int, 2> found{INT32_MAX, INT32_MIN};
  for (int k = 0; k < mask.size[2]; ++k)
    for (int j = 0; j < mask.size[1]; ++j)
      for (int i = 0; i < mask.size[0]; ++i) {
        const Vec3i v{mask.low[0] + i, mask.low[1] + j, mask.low[2] + k};
        if ((mask.bytes[mask.offset(v[0], v[1], v[2])] & bits) == 0) continue;
        found[0] = std::min(found[0], v[axis]);
        found[1] = std::max(found[1], v[axis]);
      }
  return found;
}

TEST(Rasterize, SurfaceAlongVoxelFacesTouchesOneSideOnly) {
  const SurfaceMesh box = shapes::box({2, 2, 2}, {6, 6, 6});
  const ImageGrid grid = unit_grid(10);
  const VoxelMask mask = rasterize(snap(box, grid), true, 0, {});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(extent(mask, mask_touched, axis), (std::array<int, 2>{2, 6}))
        << "a face belongs to the voxels above it";
    EXPECT_EQ(extent(mask, mask_inside, axis), (std::array<int, 2>{2, 5}));
  }
  EXPECT_EQ(std::count_if(mask.bytes.begin(), mask.bytes.end(),
                          [](std::uint8_t b) { return (b & mask_inside) != 0; }),
            64);
}

TEST(Rasterize, WindingIsNonZeroInside) {
  const ImageGrid grid = unit_grid(30);
  const auto inside = [&](const SurfaceMesh& surface, int i, int j, int k) {
    const VoxelMask mask = rasterize(snap(surface, grid), true, 0, {});
    return (mask.bytes[mask.offset(i, j, k)] & mask_inside) != 0;
  };
  const SurfaceMesh a = shapes::box({3.3, 3.3, 3.3}, {15.3, 15.3, 15.3}),
                    b = shapes::box({9.7, 9.7, 9.7}, {25, 25, 25});
  EXPECT_TRUE(inside(shapes::together(a, b), 12, 12, 12))
      << "overlapping shells count once, they do not cancel";
  EXPECT_TRUE(inside(shapes::inside_out(a), 8, 8, 8));
  const SurfaceMesh cavity = shapes::inside_out(shapes::box({6, 6, 6}, {12, 12, 12}));
  EXPECT_FALSE(inside(shapes::together(a, cavity), 9, 9, 9));
  EXPECT_TRUE(inside(shapes::together(a, cavity), 4, 9, 9));
}

TEST(Closed, TellsOpenEdgesAndClosesHairlineSlits) {
  const ImageGrid grid = unit_grid(30);
  SurfaceMesh sphere = shapes::ellipsoid({15, 15, 15}, {9, 9, 9}, 6);
  EXPECT_TRUE(is_closed(snap(sphere, grid)));
  EXPECT_TRUE(is_closed(snap(shapes::inside_out(sphere), grid)));
  // Split a vertex: its triangles no longer share it, but the slit is far below 1/256 voxel.
  SurfaceMesh slit = sphere;
  slit.V.conservativeResize(sphere.V.rows() + 1, 3);
  slit.V.row(sphere.V.rows()) = sphere.V.row(0) + Eigen::RowVector3d(1e-7, 0, 0);
  for (Eigen::Index f = 0; f < slit.F.rows() / 2; ++f)
    for (Eigen::Index c = 0; c < 3; ++c)
      if (slit.F(f, c) == 0) slit.F(f, c) = static_cast<std::int32_t>(sphere.V.rows());
  EXPECT_TRUE(is_closed(snap(slit, grid)));
  SurfaceMesh open = sphere;
  open.F.conservativeResize(sphere.F.rows() - 1, 3);
  EXPECT_FALSE(is_closed(snap(open, grid)));
  SurfaceMesh flipped = sphere;
  std::swap(flipped.F(3, 0), flipped.F(3, 1));
  EXPECT_FALSE(is_closed(snap(flipped, grid)));
}

TEST(OpenSurface, GeneralizedWindingOfASphere) {
  const SurfaceMesh sphere = shapes::ellipsoid({0, 0, 0}, {5, 5, 5}, 8);
  EXPECT_NEAR(generalized_winding(sphere, {1, 2, 0}), 1, 1e-12);
  EXPECT_NEAR(generalized_winding(sphere, {7, 2, 0}), 0, 1e-12);
  EXPECT_NEAR(generalized_winding(shapes::inside_out(sphere), {1, 2, 0}), -1, 1e-12);
}

}  // namespace
}  // namespace ecorche::voxel
