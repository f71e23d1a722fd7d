// SPDX-License-Identifier: Apache-2.0
// The parts of the voxelizer, against slow and obvious twins.
#include "preprocess/voxel/rasterize.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "preprocess/voxel/triangle_box.hpp"
#include "tests/unit/voxel/shapes.hpp"
#include "tests/unit/voxel/slow_winding.hpp"

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
    const TriangleBoxTest fast({t[0], t[1], t[2]});
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

using Of = bool (VoxelMask::*)(int, int, int) const;

std::array<int, 2> extent(const VoxelMask& mask, Of of, std::size_t axis) {
  std::array<int, 2> found{INT32_MAX, INT32_MIN};
  for (int k = 0; k < mask.size[2]; ++k)
    for (int j = 0; j < mask.size[1]; ++j)
      for (int i = 0; i < mask.size[0]; ++i) {
        const Vec3i v{mask.low[0] + i, mask.low[1] + j, mask.low[2] + k};
        if (!(mask.*of)(v[0], v[1], v[2])) continue;
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
    EXPECT_EQ(extent(mask, &VoxelMask::is_touched, axis), (std::array<int, 2>{2, 6}))
        << "a face belongs to the voxels above it";
    EXPECT_EQ(extent(mask, &VoxelMask::is_inside, axis), (std::array<int, 2>{2, 5}));
  }
  int inside = 0;
  for (const std::uint64_t word : mask.inside) inside += std::popcount(word);
  EXPECT_EQ(inside, 64);
}

TEST(Rasterize, WindingIsNonZeroInside) {
  const ImageGrid grid = unit_grid(30);
  const auto inside = [&](const SurfaceMesh& surface, int i, int j, int k) {
    const VoxelMask mask = rasterize(snap(surface, grid), true, 0, {});
    return mask.is_inside(i, j, k);
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

/// The surface on its snapped places, in units.
SurfaceMesh snapped_mesh(const SnappedSurface& snapped) {
  SurfaceMesh mesh;
  mesh.F = *snapped.F;
  mesh.V.resize(static_cast<Eigen::Index>(snapped.V.size()), 3);
  for (std::size_t v = 0; v < snapped.V.size(); ++v)
    mesh.V.row(static_cast<Eigen::Index>(v)) << snapped.V[v][0], snapped.V[v][1], snapped.V[v][2];
  return mesh;
}

/// Every voxel of the grid, by thirteen axes for every triangle, and by winding numbers. `inside`: at least
/// so many.
void expect_plain_truth(const SurfaceMesh& surface, const ImageGrid& grid, int least_inside = 10) {
  const SnappedSurface snapped = snap(surface, grid);
  ASSERT_TRUE(snapped.closed);
  const VoxelMask mask = rasterize(snapped, true, 0, {});
  std::vector<std::uint8_t> touched(grid.voxels(), 0);
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
    Vec3i t[3], low, high;
    for (Eigen::Index c = 0; c < 3; ++c) t[c] = snapped.V[static_cast<std::size_t>(surface.F(f, c))];
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min({t[0][a], t[1][a], t[2][a]}) / units;
      high[a] = std::max({t[0][a], t[1][a], t[2][a]}) / units;
    }
    for (int k = low[2]; k <= high[2]; ++k)
      for (int j = low[1]; j <= high[1]; ++j)
        for (int i = low[0]; i <= high[0]; ++i)
          if (overlap_by_all_axes(t, {i, j, k})) touched[grid.offset(i, j, k)] = 1;
  }
  const SurfaceMesh plain = snapped_mesh(snapped);
  int inside = 0;
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i) {
        const Vec3i v{i, j, k};
        bool held = true;
        for (std::size_t a = 0; a < 3; ++a)
          held = held && v[a] >= mask.low[a] && v[a] < mask.low[a] + mask.size[a];
        ASSERT_EQ(held && mask.is_touched(i, j, k), touched[grid.offset(i, j, k)] != 0)
            << i << " " << j << " " << k;
        const double winding =
            generalized_winding(plain, Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5) * double{units});
        if (std::abs(winding - std::round(winding)) > 1e-6) continue;  // on the surface
        ASSERT_EQ(held && mask.is_inside(i, j, k), std::lround(winding) != 0) << i << " " << j << " " << k;
        inside += winding > 0.5 ? 1 : 0;
      }
  EXPECT_GE(inside, least_inside);
}

TEST(Rasterize, EqualsPlainTruthOverSeveralWordsOfARow) {
  ImageGrid grid = unit_grid(16);
  grid.size[0] = 150;
  // Triangles of a fraction of a voxel, of one or two, and of many.
  for (const int n : {2, 5, 14}) {
    SCOPED_TRACE(n);
    expect_plain_truth(shapes::ellipsoid({74.3, 8.1, 7.7}, {70, 6.3, 5.9}, n), grid);
    expect_plain_truth(shapes::ellipsoid({63.9, 8.1, 7.7}, {3.2, 3.3, 3.4}, n), grid);
  }
  expect_plain_truth(shapes::box({2.5, 3.5, 4.5}, {128.5, 9.5, 11.5}), grid);  // on voxel centres
}

TEST(Rasterize, EqualsPlainTruthWhereOneTriangleCrossesTheGrid) {
  SurfaceMesh mesh;
  mesh.V.resize(4, 3);
  mesh.V << 1.2, 2.3, 1.7, 47.1, 5.2, 9.9, 8.4, 46.8, 20.3, 21.6, 12.2, 47.3;
  mesh.F.resize(4, 3);
  mesh.F << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
  expect_plain_truth(mesh, unit_grid(49));
}

SurfaceMesh random_tetrahedron(std::mt19937& random, double low, double high, double size) {
  std::uniform_real_distribution<double> place(low, high), spread(-size, size);
  const Eigen::RowVector3d middle(place(random), place(random), place(random));
  SurfaceMesh mesh;
  mesh.V.resize(4, 3);
  for (Eigen::Index v = 0; v < 4; ++v)
    mesh.V.row(v) = middle + Eigen::RowVector3d(spread(random), spread(random), spread(random));
  mesh.F.resize(4, 3);
  mesh.F << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
  return mesh;
}

TEST(Rasterize, WhatOtherTrianglesMarkedHidesNothing) {
  std::mt19937 random(23);
  for (int n = 0; n < 300; ++n) {
    SCOPED_TRACE(n);
    SurfaceMesh all = random_tetrahedron(random, 2, 5, 0.1);
    for (int m = 0; m < 12; ++m) all = shapes::together(all, random_tetrahedron(random, 2, 5, 0.1));
    for (int m = 0; m < 4; ++m) all = shapes::together(all, random_tetrahedron(random, 2.5, 4.5, 1.5));
    expect_plain_truth(all, unit_grid(7), 0);
    if (HasFatalFailure()) return;
  }
}

TEST(Masks, RunsOfAWord) {
  using Runs = std::vector<std::array<int, 2>>;
  const auto runs = [](std::uint64_t word) {
    Runs out;
    for_runs(word, [&](int first, int count) { out.push_back({first, count}); });
    return out;
  };
  EXPECT_EQ(runs(0), Runs{});
  EXPECT_EQ(runs(~std::uint64_t{0}), (Runs{{0, 64}}));
  EXPECT_EQ(runs(0x8000'0000'0000'0001), (Runs{{0, 1}, {63, 1}}));
  EXPECT_EQ(runs(0xf0'0000'0036), (Runs{{1, 2}, {4, 2}, {36, 4}}));
}

TEST(Closed, TellsOpenEdgesAndClosesHairlineSlits) {
  const ImageGrid grid = unit_grid(30);
  SurfaceMesh sphere = shapes::ellipsoid({15, 15, 15}, {9, 9, 9}, 6);
  EXPECT_TRUE(snap(sphere, grid).closed);
  EXPECT_TRUE(snap(shapes::inside_out(sphere), grid).closed);
  // Split a vertex: its triangles no longer share it, but the slit is far below 1/256 voxel.
  SurfaceMesh slit = sphere;
  slit.V.conservativeResize(sphere.V.rows() + 1, 3);
  slit.V.row(sphere.V.rows()) = sphere.V.row(0) + Eigen::RowVector3d(1e-7, 0, 0);
  for (Eigen::Index f = 0; f < slit.F.rows() / 2; ++f)
    for (Eigen::Index c = 0; c < 3; ++c)
      if (slit.F(f, c) == 0) slit.F(f, c) = static_cast<std::int32_t>(sphere.V.rows());
  EXPECT_TRUE(snap(slit, grid).closed);
  SurfaceMesh open = sphere;
  open.F.conservativeResize(sphere.F.rows() - 1, 3);
  EXPECT_FALSE(snap(open, grid).closed);
  SurfaceMesh flipped = sphere;
  std::swap(flipped.F(3, 0), flipped.F(3, 1));
  EXPECT_FALSE(snap(flipped, grid).closed);
}

TEST(WindingTree, OfASphere) {
  const SurfaceMesh sphere = shapes::ellipsoid({0, 0, 0}, {5, 5, 5}, 8);
  EXPECT_NEAR(generalized_winding(sphere, {1, 2, 0}), 1, 1e-12);
  EXPECT_NEAR(generalized_winding(sphere, {7, 2, 0}), 0, 1e-12);
  EXPECT_NEAR(generalized_winding(shapes::inside_out(sphere), {1, 2, 0}), -1, 1e-12);
}

TEST(WindingTree, EqualsTheSumOverAllTriangles) {
  SurfaceMesh whole = shapes::ellipsoid({30, -20, 7}, {10, 20, 5}, 24);
  SurfaceMesh open = whole;
  open.F.conservativeResize(whole.F.rows() * 2 / 3, 3);
  SurfaceMesh soup = whole;  // every other triangle is turned over
  for (Eigen::Index f = 0; f < soup.F.rows(); f += 2) std::swap(soup.F(f, 0), soup.F(f, 1));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(-1.6, 1.6);
  for (const SurfaceMesh& surface : {whole, open, soup, SurfaceMesh{}}) {
    const geometry::WindingTree tree(surface);
    double worst = 0;
    for (int n = 0; n < 2000; ++n) {
      const Eigen::Vector3d p(30 + 10 * draw(random), -20 + 20 * draw(random), 7 + 5 * draw(random));
      worst = std::max(worst, std::abs(tree(p) - generalized_winding(surface, p)));
    }
    EXPECT_LE(worst, 0.02);
  }
}

}  // namespace
}  // namespace ecorche::voxel
