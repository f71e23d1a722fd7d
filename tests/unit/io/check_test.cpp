// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "preprocess/check/inside.hpp"
#include "preprocess/check/inside_cells.hpp"
#include "preprocess/check/inspect_case.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::check {
namespace {

using Eigen::Vector3d;

// A sphere of latitude and longitude, outward.
SurfaceMesh sphere(const Vector3d& center, double radius, int steps) {
  SurfaceMesh mesh;
  std::vector<Vector3d> points{center + Vector3d(0, 0, radius)};
  for (int i = 1; i < steps; ++i) {
    for (int j = 0; j < 2 * steps; ++j) {
      const double a = std::numbers::pi * i / steps, b = std::numbers::pi * j / steps;
      points.push_back(center +
                       radius * Vector3d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)));
    }
  }
  points.push_back(center - Vector3d(0, 0, radius));
  std::vector<Eigen::RowVector3i> faces;
  const auto at = [&](int i, int j) {
    return i == 0       ? 0
           : i == steps ? static_cast<int>(points.size()) - 1
                        : 1 + (i - 1) * 2 * steps + j % (2 * steps);
  };
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < 2 * steps; ++j) {
      if (i + 1 < steps) faces.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      if (i > 0) faces.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  mesh.V.resize(static_cast<Eigen::Index>(points.size()), 3);
  mesh.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    mesh.V.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  for (std::size_t i = 0; i < faces.size(); ++i) mesh.F.row(static_cast<Eigen::Index>(i)) = faces[i];
  return mesh;
}

void drop_triangle(SurfaceMesh& mesh, Eigen::Index f) {
  mesh.F.row(f) = mesh.F.row(mesh.F.rows() - 1);
  mesh.F.conservativeResize(mesh.F.rows() - 1, 3);
}

TEST(SurfaceFigures, ACleanBox) {
  const SurfaceFigures f = measure(box({1000, 2000, 3000}, {1010, 2020, 3030}));
  EXPECT_TRUE(f.closed());
  EXPECT_EQ(f.vertices, 8);
  EXPECT_EQ(f.triangles, 12);
  EXPECT_EQ(f.components, 1);
  EXPECT_EQ(f.degenerate.count, 0);
  EXPECT_NEAR(f.volume_mm3, 6000, 1e-9);
}

TEST(SurfaceFigures, EveryFaultIsCountedAndPlaced) {
  SurfaceMesh open = box({0, 0, 0}, {1, 1, 1});
  drop_triangle(open, 0);  // corners 0, 1, 2
  EXPECT_EQ(measure(open).open.count, 3);
  SurfaceMesh flipped = box({0, 0, 0}, {1, 1, 1});
  flipped.F.row(0) = flipped.F.row(0).reverse().eval();
  EXPECT_EQ(measure(flipped).flipped.count, 3);
  EXPECT_EQ(measure(flipped).open.count, 0);
  // A fin on the edge from vertex 0 to vertex 1, along y at x = z = 0.
  SurfaceMesh fin = box({0, 0, 0}, {1, 1, 1});
  fin.V.conservativeResize(9, 3);
  fin.V.row(8) << -1, 0.5, -1;
  fin.F.conservativeResize(13, 3);
  fin.F.row(12) << 0, 1, 8;
  const SurfaceFigures f = measure(fin);
  EXPECT_EQ(f.nonmanifold.count, 1);
  EXPECT_EQ(*f.nonmanifold.first, Vector3d(0, 0.5, 0));
  EXPECT_EQ(f.open.count, 2);
  // Two equal corners, and three on a line.
  SurfaceMesh flat = box({0, 0, 0}, {1, 1, 1});
  flat.F.conservativeResize(14, 3);
  flat.F.row(12) << 3, 3, 1;
  flat.V.conservativeResize(11, 3);
  flat.V.bottomRows(3) << 5, 5, 5, 6, 6, 6, 7, 7, 7;
  flat.F.row(13) << 8, 9, 10;
  EXPECT_EQ(measure(flat).degenerate.count, 2);
  EXPECT_EQ(*measure(flat).degenerate.first, Vector3d(1, 1, 0));
  EXPECT_EQ(measure(flat).components, 2);
  SurfaceMesh inward = box({0, 0, 0}, {1, 1, 1});
  inward.F.col(1).swap(inward.F.col(2));
  EXPECT_TRUE(measure(inward).closed());
  EXPECT_NEAR(measure(inward).volume_mm3, -1, 1e-12);
}

// The obvious answer: solid angles of all triangles (van Oosterom and Strackee 1983) add up to 4 pi inside.
double winding_number(const SurfaceMesh& mesh, const Vector3d& p) {
  double sum = 0;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const Vector3d a = mesh.V.row(mesh.F(f, 0)).transpose() - p, b = mesh.V.row(mesh.F(f, 1)).transpose() - p,
                   c = mesh.V.row(mesh.F(f, 2)).transpose() - p;
    sum += 2 * std::atan2(a.dot(b.cross(c)), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                                                 b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return sum / (4 * std::numbers::pi);
}

TEST(Inside, EqualsTheWindingNumber) {
  const SurfaceMesh mesh = sphere({3, -2, 7}, 10, 12);
  const Inside inside(mesh);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(-12, 12);
  int within = 0;
  for (int i = 0; i < 3000; ++i) {
    // Half of the points have coordinates of vertices, so that rays meet vertices and edges.
    Vector3d p = Vector3d(3, -2, 7) + Vector3d(uniform(random), uniform(random), uniform(random));
    if (i % 2 == 0)
      p[i / 2 % 3] =
          mesh.V(static_cast<Eigen::Index>(random() % static_cast<unsigned>(mesh.V.rows())), i / 2 % 3);
    const double winding = winding_number(mesh, p);
    if (std::abs(winding - 0.5) < 0.49) continue;  // on the surface
    EXPECT_EQ(inside(p), winding > 0.5) << p.transpose();
    within += winding > 0.5;
  }
  EXPECT_GT(within, 300);
}

TEST(InsideCells, EqualInside) {
  SurfaceMesh shells = sphere({3, -2, 7}, 10, 24);  // and one within another: a cavity
  const Eigen::Index V = shells.V.rows(), F = shells.F.rows();
  const SurfaceMesh cavity = sphere({4, -1, 6}, 6, 24);
  shells.V.conservativeResize(2 * V, 3);
  shells.V.bottomRows(V) = cavity.V;
  shells.F.conservativeResize(2 * F, 3);
  shells.F.bottomRows(F) = cavity.F.rowwise().reverse().array() + static_cast<std::int32_t>(V);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform(-12, 12);
  for (const SurfaceMesh& mesh :
       {shells, box({-1, -1, -1}, {1, 1, 1}), box({0, 0, 0}, {10, 0, 3}), SurfaceMesh()}) {
    const Inside inside(mesh);
    const InsideCells cells(mesh, inside);
    for (int i = 0; i < 20'000; ++i) {
      Vector3d p(uniform(random), uniform(random), uniform(random));
      if (i % 4 == 0 && mesh.V.rows() > 0)
        p[i / 4 % 3] =
            mesh.V(static_cast<Eigen::Index>(random() % static_cast<unsigned>(mesh.V.rows())), i / 4 % 3);
      ASSERT_EQ(cells(p), inside(p)) << p.transpose();
    }
  }
}

TEST(Inside, RaysThroughEdgesAndCorners) {
  const SurfaceMesh cube = box({-1, -1, -1}, {1, 1, 1});
  const Inside inside(cube);
  for (const Vector3d& p :
       {Vector3d(0, 0, 0), Vector3d(0.5, 0.5, 0.5), Vector3d(-0.5, 0.5, 0), Vector3d(0, 0, 0.999)}) {
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ(inside.crossings(p, axis), 1) << p.transpose() << " along " << axis;
    EXPECT_TRUE(inside(p));
  }
  for (const Vector3d& p :
       {Vector3d(2, 0, 0), Vector3d(-2, 0, 0), Vector3d(0, 0, -3), Vector3d(2, 2, 2), Vector3d(0, 1.001, 0)})
    EXPECT_FALSE(inside(p));
}

TEST(Inside, AHoleIsOutvoted) {
  SurfaceMesh mesh = sphere({0, 0, 0}, 10, 16);
  // Opens the cap around +z: rays along z from below it leave through the hole.
  for (Eigen::Index f = mesh.F.rows() - 1; f >= 0; --f) {
    if (mesh.V(mesh.F(f, 0), 2) > 9) drop_triangle(mesh, f);
  }
  const Inside inside(mesh);
  EXPECT_EQ(inside.crossings({0.1, 0.2, 5}, 2), 0);
  EXPECT_TRUE(inside({0.1, 0.2, 5}));
  EXPECT_FALSE(inside({0.1, 0.2, 12}));
}

const Finding* find(const Report& report, const std::string& where, const std::string& what) {
  for (const Finding& finding : report.findings) {
    if (finding.where == where && finding.what.find(what) != std::string::npos) return &finding;
  }
  return nullptr;
}

TEST(Inspect, ACleanCaseHasNoFinding) {
  const Report report = inspect(small_case(), Context{});
  EXPECT_TRUE(report.findings.empty()) << report.findings[0].where << ": " << report.findings[0].what;
  EXPECT_TRUE(report.possible());
  ASSERT_EQ(report.surfaces.size(), 4u);
  ASSERT_TRUE(report.surfaces[1].outside);
  EXPECT_EQ(report.surfaces[1].outside->share, 0);
}

TEST(Inspect, BonesOutsideTheSkinAreMeasured) {
  Case patient = small_case();
  patient.bones[1].surface = box({-10, -10, -130}, {10, 10, 10});  // 30 mm through the sole at z = -100
  const Report report = inspect(patient, Context{});
  const Finding* finding = find(report, "femur_right", "4 vertices (50 %) outside the skin, by up to 30 mm");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(static_cast<int>(finding->severity), static_cast<int>(Severity::warning));
  EXPECT_NEAR(report.surfaces[2].outside->largest_mm, 30, 1e-9);
  EXPECT_EQ(finding->at->z(), -130);
  EXPECT_TRUE(report.possible());
}

TEST(Inspect, FaultsOfSkinAndBonesWarnOthersAreNoted) {
  Case patient = small_case();
  drop_triangle(patient.skin, 0);
  drop_triangle(patient.tissues[0].surface, 0);
  const Report report = inspect(patient, Context{});
  ASSERT_NE(find(report, "skin", "3 open edges"), nullptr);
  EXPECT_EQ(static_cast<int>(find(report, "skin", "3 open edges")->severity),
            static_cast<int>(Severity::warning));
  EXPECT_EQ(static_cast<int>(find(report, "rectus_femoris", "3 open edges")->severity),
            static_cast<int>(Severity::note));
  EXPECT_TRUE(report.possible());
}

TEST(Inspect, WhatCannotBelongTogether) {
  Case patient = small_case();
  patient.tissues[0].surface = box({1000, 0, 0}, {1010, 10, 10});
  patient.volumes[0].image.grid.origin = {5000, 0, 0};
  patient.skeleton.segments.push_back({.name = "toe", .parent = 1, .joint = {}, .aliases = {}});
  const Report report = inspect(patient, Context{});
  EXPECT_NE(find(report, "rectus_femoris", "lies wholly outside the skin's bounds"), nullptr);
  EXPECT_NE(find(report, "ct", "has the label map's voxels, but lies up to 5.04e+03 mm from it"), nullptr);
  patient.labels.reset();
  EXPECT_NE(find(inspect(patient, Context{}), "ct", "does not meet the skin: they lie 4.94e+03 mm apart"),
            nullptr);
  patient.volumes[0].image.grid = {{100, 100, 200}, {-50, -50, -200}, {1, 1, 1}};  // 100 mm below
  EXPECT_NE(
      find(inspect(patient, Context{}), "ct", "50 % of the skin lies outside of this image, by up to 101 mm"),
      nullptr);
  const Finding* toe = find(report, "toe", "no bone belongs to this segment");
  ASSERT_NE(toe, nullptr);
  EXPECT_NE(toe->mend.find("'thigh_right'"), std::string::npos);
  EXPECT_TRUE(report.possible());
}

TEST(Inspect, WhatMakesPreparingImpossible) {
  Case empty = small_case();
  empty.skin = {};
  EXPECT_FALSE(inspect(empty, Context{}).possible());
  Case boneless = small_case();
  boneless.bones.clear();
  EXPECT_FALSE(inspect(boneless, Context{}).possible());
  Case flat = small_case();
  flat.skin = box({-50, -40, 0}, {50, 40, 0});
  EXPECT_NE(find(inspect(flat, Context{}), "skin", "encloses no volume"), nullptr);
  Case away = small_case();
  away.skin.V *= 0.001;  // metres taken for millimetres
  const Report report = inspect(away, Context{});
  EXPECT_NE(find(report, "skin", "is 0.2 mm long"), nullptr);
  away.skin.V.rowwise() += Eigen::RowVector3d(0, 0, 1000);
  EXPECT_NE(find(inspect(away, Context{}), "bones", "all lie outside the skin's bounds"), nullptr);
  EXPECT_FALSE(inspect(away, Context{}).possible());
}

TEST(Inspect, AStopIsSeen) {
  std::stop_source source;
  source.request_stop();
  Context context;
  context.stop = source.get_token();
  EXPECT_THROW(inspect(small_case(), context), Error);
}

}  // namespace
}  // namespace ecorche::check
