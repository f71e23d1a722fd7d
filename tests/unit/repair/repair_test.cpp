// SPDX-License-Identifier: Apache-2.0
#include "preprocess/repair/repair_surface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "core/geometry/hole_size.hpp"
#include "preprocess/check/surface_figures.hpp"
#include "preprocess/check/surface_parts.hpp"
#include "preprocess/repair/soup.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::repair {
namespace {

using Eigen::Vector3d;

SurfaceMesh together(const std::vector<SurfaceMesh>& meshes) {
  SurfaceMesh out;
  for (const SurfaceMesh& mesh : meshes) {
    const Eigen::Index v = out.V.rows(), f = out.F.rows();
    out.V.conservativeResize(v + mesh.V.rows(), 3);
    out.F.conservativeResize(f + mesh.F.rows(), 3);
    out.V.bottomRows(mesh.V.rows()) = mesh.V;
    out.F.bottomRows(mesh.F.rows()) = mesh.F.array() + static_cast<std::int32_t>(v);
  }
  return out;
}

void add_triangle(SurfaceMesh& mesh, std::int32_t a, std::int32_t b, std::int32_t c) {
  mesh.F.conservativeResize(mesh.F.rows() + 1, 3);
  mesh.F.bottomRows(1) << a, b, c;
}

void drop_triangle(SurfaceMesh& mesh, Eigen::Index f) {
  mesh.F.row(f) = mesh.F.row(mesh.F.rows() - 1).eval();
  mesh.F.conservativeResize(mesh.F.rows() - 1, 3);
}

const SurfaceMesh kBox = box({0, 0, 0}, {10, 20, 30});

Mended mend(const SurfaceMesh& mesh, const Options& options = {}) {
  return repair_surface(mesh, options, Context{});
}

// Whatever was wrong, the box of 6 ml comes out whole.
void expect_the_box(const Mended& mended) {
  const check::SurfaceFigures figures = check::measure(mended.mesh);
  EXPECT_TRUE(figures.closed());
  EXPECT_EQ(figures.components, 1);
  EXPECT_NEAR(figures.volume_mm3, 6000, 3);
}

TEST(Repair, AGoodSurfaceStaysAsItIs) {
  const Mended mended = mend(kBox);
  EXPECT_FALSE(mended.done.anything());
  EXPECT_EQ(mended.mesh.V, kBox.V);
  EXPECT_EQ(mended.mesh.F, kBox.F);
}

TEST(Repair, FillsAHole) {
  SurfaceMesh open = kBox;
  drop_triangle(open, 3);
  drop_triangle(open, 2);
  const Mended mended = mend(open);
  EXPECT_EQ(mended.done.holes, 1);
  EXPECT_EQ(mended.done.filling, 2);
  expect_the_box(mended);
  // Larger than allowed: it stays, and is counted.
  const Mended kept = mend(open, {.hole_mm = 5});
  EXPECT_EQ(kept.done.holes, 0);
  EXPECT_EQ(kept.done.holes_left, 1);
  EXPECT_EQ(check::measure(kept.mesh).open.count, 4);
}

// A tube of n sides, open at both ends, 100 mm long, 30 mm across.
SurfaceMesh tube(int n) {
  SurfaceMesh mesh;
  mesh.V.resize(2 * n, 3);
  mesh.F.resize(2 * n, 3);
  for (int i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * i / n;
    mesh.V.row(i) << 15 * std::cos(a), 15 * std::sin(a), 0;
    mesh.V.row(n + i) << 15 * std::cos(a), 15 * std::sin(a), 100;
    const int j = (i + 1) % n;
    mesh.F.row(2 * i) << i, j, n + i;
    mesh.F.row(2 * i + 1) << j, n + j, n + i;
  }
  return mesh;
}

TEST(Repair, WhatClosesTheLargestHoleIsTold) {
  for (const int n : {12, 300, 2500}) {  // of more than 800 edges corners are cut off first
    const SurfaceMesh open = tube(n);
    const geometry::LargestHole hole = geometry::largest_hole(open);
    EXPECT_EQ(hole.holes, 2U);
    EXPECT_EQ(hole.edges, static_cast<std::size_t>(n));
    EXPECT_TRUE(hole.closed);
    const double disc = 0.5 * n * 225 * std::sin(2 * std::numbers::pi / n);
    EXPECT_NEAR(hole.filling_edge, std::sqrt(disc), 0.01);
    EXPECT_EQ(mend(open, {.hole_mm = 0.99 * hole.filling_edge}).done.holes_left, 2);
    const Mended mended = mend(open, {.hole_mm = 1.01 * hole.filling_edge});
    EXPECT_EQ(mended.done.holes_left, 0);
    const check::SurfaceFigures figures = check::measure(mended.mesh);
    EXPECT_TRUE(figures.closed());
    EXPECT_NEAR(figures.volume_mm3, 100 * disc, 0.01 * disc);
  }
}

TEST(Repair, WeldsASlit) {
  // The lid has corners of its own, a hundredth of a millimetre off.
  SurfaceMesh slit = kBox;
  slit.V.conservativeResize(12, 3);
  for (int c = 0; c < 4; ++c) slit.V.row(8 + c) = kBox.V.row(4 + c).array() + 0.01;
  for (int f = 2; f < 4; ++f) slit.F.row(f).array() += 4;
  EXPECT_EQ(check::measure(slit).open.count, 8);
  const Mended mended = mend(slit);
  EXPECT_EQ(mended.done.welded, 4);
  expect_the_box(mended);
  EXPECT_EQ(mend(slit, {.weld_mm = 0.001, .hole_mm = 0}).done.welded, 0);
}

TEST(Repair, TurnsFlippedTrianglesAndWholeSurfaces) {
  SurfaceMesh flipped = kBox;
  flipped.F.row(5) = flipped.F.row(5).reverse().eval();
  const Mended one = mend(flipped);
  EXPECT_EQ(one.done.turned, 1);
  EXPECT_EQ(one.done.outward, 0);
  expect_the_box(one);
  SurfaceMesh inward = kBox;
  inward.F.col(0).swap(inward.F.col(1));
  const Mended all = mend(inward);
  EXPECT_EQ(all.done.turned, 0);
  EXPECT_EQ(all.done.outward, 1);
  expect_the_box(all);
}

TEST(Repair, DropsWhatIsNoSurface) {
  SurfaceMesh mesh = kBox;
  add_triangle(mesh, 0, 1, 2);  // a duplicate of row 0
  add_triangle(mesh, 3, 3, 5);  // no triangle
  mesh.V.conservativeResize(9, 3);
  mesh.V.row(8) << -5, 10, -5;
  add_triangle(mesh, 0, 1, 8);  // a fin on an edge
  const Mended mended = mend(mesh);
  EXPECT_EQ(mended.done.duplicates, 1);
  EXPECT_EQ(mended.done.degenerate, 1);
  EXPECT_EQ(mended.done.fins, 1);
  expect_the_box(mended);
}

TEST(Repair, DropsLoneTrianglesButNeverTheLast) {
  SurfaceMesh mesh = kBox;
  mesh.V.conservativeResize(10, 3);
  mesh.V.bottomRows(2) << 50, 0, 0, 50, 9, 0;
  add_triangle(mesh, 7, 8, 9);
  const Mended mended = mend(mesh);
  EXPECT_EQ(mended.done.fins, 1);
  expect_the_box(mended);
  SurfaceMesh one = kBox;
  one.F.conservativeResize(1, 3);
  EXPECT_EQ(mend(one).mesh.F.rows(), 1);
}

TEST(Repair, DropsSpecksAndOnRequestWhatIsInside) {
  SurfaceMesh cavity = box({4, 4, 4}, {8, 8, 8});
  cavity.F.col(0).swap(cavity.F.col(1));
  const SurfaceMesh mesh = together({box({50, 0, 0}, {50.5, 0.5, 0.5}), kBox, cavity});
  const Mended hollow = mend(mesh);
  EXPECT_EQ(hollow.done.specks, 1);
  EXPECT_EQ(hollow.done.outward, 0);  // a cavity is meant
  EXPECT_EQ(check::measure(hollow.mesh).components, 2);
  EXPECT_NEAR(check::measure(hollow.mesh).volume_mm3, 6000 - 64, 1e-3);
  const Mended full = mend(mesh, {.drop_inner = true});
  EXPECT_EQ(full.done.inner, 1);
  expect_the_box(full);
  EXPECT_EQ(mend(mesh, {.speck_mm = 0}).done.specks, 0);
}

// What a file makes of the mended surface: equal places become one vertex.
SurfaceMesh as_read(const SurfaceMesh& mesh) {
  std::map<std::array<double, 3>, std::int32_t> known;
  SurfaceMesh out = mesh;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const auto p = mesh.V.row(mesh.F(f, c));
      out.F(f, c) = known.try_emplace({p.x(), p.y(), p.z()}, mesh.F(f, c)).first->second;
    }
  }
  return out;
}

TEST(Repair, SolidsThatShareAnEdgeComeApart) {
  // Two boxes meet along the edge x = 10, y = 20, and a third in the corner (0, 0, 0).
  const SurfaceMesh mesh =
      as_read(together({kBox, box({10, 20, 0}, {15, 25, 30}), box({-5, -5, -5}, {0, 0, 0})}));
  EXPECT_EQ(check::measure(mesh).nonmanifold.count, 1);
  const Mended mended = mend(mesh);
  EXPECT_EQ(mended.done.split, 3);  // two ends of the edge, and the corner
  EXPECT_EQ(mended.done.holes + mended.done.turned, 0);
  const check::SurfaceFigures figures = check::measure(as_read(mended.mesh));
  EXPECT_TRUE(figures.closed());
  EXPECT_EQ(figures.components, 3);
  EXPECT_NEAR(figures.volume_mm3, 6000 + 750 + 125, 1);
}

// All ways to cut a polygon of these corners into triangles.
double least_area(const std::vector<Vector3d>& p, std::size_t i, std::size_t k) {
  if (k < i + 2) return 0;
  double best = 1e300;
  for (std::size_t j = i + 1; j < k; ++j) {
    const double area = 0.5 * (p[j] - p[i]).cross(p[k] - p[i]).norm();
    best = std::min(best, area + least_area(p, i, j) + least_area(p, j, k));
  }
  return best;
}

TEST(FillHoles, LeastAreaOfAllTriangulations) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> at(-10, 10);
  for (int round = 0; round < 40; ++round) {
    // A cone over a ragged rim: its only hole is the rim.
    const std::int32_t n = 4 + round % 6;
    Soup soup;
    std::vector<Vector3d> rim;
    for (std::int32_t i = 0; i < n; ++i) rim.emplace_back(at(random), at(random), at(random));
    soup.points = rim;
    soup.points.emplace_back(0, 0, 50);
    for (std::int32_t i = 0; i < n; ++i) soup.triangles.push_back({i, (i + 1) % n, n});
    const Filled filled = fill_holes(soup, 1e9, Context{});
    EXPECT_EQ(filled.holes, 1);
    ASSERT_EQ(filled.triangles, n - 2);
    double area = 0;
    for (std::size_t f = static_cast<std::size_t>(n); f < soup.triangles.size(); ++f) {
      const auto& t = soup.triangles[f];
      const auto p = [&](std::size_t c) { return soup.points[static_cast<std::size_t>(t[c])]; };
      area += 0.5 * (p(1) - p(0)).cross(p(2) - p(0)).norm();
    }
    EXPECT_NEAR(area, least_area(rim, 0, rim.size() - 1), 1e-9);
    EXPECT_TRUE(check::measure(soup.mesh()).closed());
  }
}

// Whatever is broken, nothing that is written has an edge of three triangles or one that runs two ways.
TEST(Repair, RandomDamageNeverLeavesANonManifoldEdge) {
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    SurfaceMesh mesh = as_read(together({kBox, box({10, 0, 0}, {20, 20, 30}), box({0, 20, 0}, {10, 30, 5})}));
    const auto vertices = static_cast<unsigned>(mesh.V.rows());
    for (int n = 0; n < 1 + round % 5; ++n) {
      const auto f = static_cast<Eigen::Index>(random() % static_cast<unsigned>(mesh.F.rows()));
      switch (random() % 4) {
        case 0:
          drop_triangle(mesh, f);
          break;
        case 1:
          mesh.F.row(f) = mesh.F.row(f).reverse().eval();
          break;
        case 2:
          mesh.F(f, 0) = static_cast<std::int32_t>(random() % vertices);
          break;
        default:
          add_triangle(mesh, static_cast<std::int32_t>(random() % vertices),
                       static_cast<std::int32_t>(random() % vertices),
                       static_cast<std::int32_t>(random() % vertices));
      }
    }
    const check::SurfaceFigures figures = check::measure(mend(mesh).mesh);
    EXPECT_EQ(figures.nonmanifold.count, 0) << round;
    EXPECT_EQ(figures.flipped.count, 0) << round;
    EXPECT_EQ(figures.duplicate.count, 0) << round;
  }
}

TEST(Repair, AStopIsSeen) {
  std::stop_source source;
  source.request_stop();
  Context context;
  context.stop = source.get_token();
  EXPECT_THROW(repair_surface(kBox, {}, context), Error);
}

}  // namespace
}  // namespace ecorche::repair
