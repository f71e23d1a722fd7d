// SPDX-License-Identifier: Apache-2.0
// Each defect that check names, made on purpose.
#include <gtest/gtest.h>

#include <random>

#include "preprocess/check/frames.hpp"
#include "preprocess/check/inspect_case.hpp"
#include "preprocess/check/label_ids.hpp"
#include "preprocess/check/self_intersections.hpp"
#include "preprocess/check/surface_parts.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::check {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

bool finds(const Case& patient, const std::string& where, const std::string& what,
           const std::string& mend = "") {
  std::string all;
  for (const Finding& f : inspect(patient, Context{}).findings) {
    all += f.where + ": " + f.what + " (" + f.mend + ")\n";
    if (f.where == where && f.what.find(what) != std::string::npos && f.mend.find(mend) != std::string::npos)
      return true;
  }
  ADD_FAILURE() << where << ": " << what << " is not among\n" << all;
  return false;
}

void turn(SurfaceMesh& mesh, const Matrix3d& m) {
  mesh.V = (mesh.V * m.transpose()).eval();
}

TEST(Defects, HolesHaveTheirPlaceAndLength) {
  SurfaceMesh mesh = box({0, 0, 0}, {10, 20, 30});
  mesh.F.row(0) = mesh.F.row(10).eval();  // opens half of z low, and half of x high
  mesh.F.conservativeResize(10, 3);
  const SurfaceFigures figures = measure(mesh);
  ASSERT_EQ(figures.holes.size(), 2u);
  EXPECT_EQ(figures.holes[0].edges, 3);
  EXPECT_NEAR(figures.holes[0].length_mm, 20 + 30 + std::hypot(20, 30), 1e-12);
  EXPECT_NEAR(figures.holes[1].length_mm, 10 + 20 + std::hypot(10, 20), 1e-12);
  EXPECT_NEAR(figures.holes[1].middle.z(), 0, 1e-12);
  EXPECT_NEAR(figures.holes[0].middle.x(), 10, 1e-12);
}

TEST(Defects, FlippedAndDuplicateTrianglesAreCounted) {
  Case patient = small_case();
  SurfaceMesh& mesh = patient.bones[0].surface;
  mesh.F.row(4) = mesh.F.row(4).reverse().eval();
  EXPECT_EQ(measure(mesh).turned.count, 1);
  finds(patient, "pelvis_bone", "1 flipped triangle");
  patient = small_case();
  patient.skin.F.conservativeResize(13, 3);
  patient.skin.F.row(12) << patient.skin.F(2, 1), patient.skin.F(2, 2), patient.skin.F(2, 0);
  EXPECT_EQ(measure(patient.skin).duplicate.count, 1);
  finds(patient, "skin", "1 duplicate triangle");
}

#ifdef ECORCHE_GPL
// Does segment p q cross triangle a b c? For points in general position.
bool crosses(const Vector3d& p, const Vector3d& q, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const auto side = [](const Vector3d& x, const Vector3d& y, const Vector3d& z, const Vector3d& w) {
    return (y - x).cross(z - x).dot(w - x) > 0;
  };
  if (side(a, b, c, p) == side(a, b, c, q)) return false;
  return side(p, q, a, b) == side(p, q, b, c) && side(p, q, b, c) == side(p, q, c, a);
}

TEST(SelfIntersections, EqualsAllPairsOfASoup) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> at(-10, 10), edge(-4, 4);
  SurfaceMesh soup;
  const int count = 150;
  soup.V.resize(3 * count, 3);
  soup.F.resize(count, 3);
  for (int f = 0; f < count; ++f) {
    const Eigen::RowVector3d middle(at(random), at(random), at(random));
    for (int k = 0; k < 3; ++k) {
      soup.F(f, k) = 3 * f + k;
      soup.V.row(3 * f + k) = middle + Eigen::RowVector3d(edge(random), edge(random), edge(random));
    }
  }
  const auto corner = [&](int f, int k) -> Vector3d { return soup.V.row(3 * f + k % 3).transpose(); };
  std::int64_t truth = 0;
  for (int f = 0; f < count; ++f) {
    for (int g = f + 1; g < count; ++g) {
      bool meet = false;
      for (int k = 0; k < 3; ++k) {
        meet = meet || crosses(corner(f, k), corner(f, k + 1), corner(g, 0), corner(g, 1), corner(g, 2)) ||
               crosses(corner(g, k), corner(g, k + 1), corner(f, 0), corner(f, 1), corner(f, 2));
      }
      truth += meet;
    }
  }
  EXPECT_GT(truth, 30);
  EXPECT_EQ(self_intersections(soup, Context{})->count, truth);
}

TEST(SelfIntersections, SharedCornersAndEdgesAreNone) {
  EXPECT_EQ(self_intersections(box({0, 0, 0}, {1, 1, 1}), Context{})->count, 0);
  SurfaceMesh fold;  // two triangles on one edge, folded flat onto each other
  fold.V.resize(4, 3);
  fold.V << 0, 0, 0, 4, 0, 0, 1, 2, 0, 2, 3, 0;
  fold.F.resize(2, 3);
  fold.F << 0, 1, 2, 1, 0, 3;
  EXPECT_EQ(self_intersections(fold, Context{})->count, 1);
  fold.V.row(3) << 2, -3, 0;
  EXPECT_EQ(self_intersections(fold, Context{})->count, 0);
  Case patient = small_case();
  SurfaceMesh& mesh = patient.bones[1].surface;
  mesh.V(7, 0) -= 100;  // a corner through the opposite wall
  finds(patient, "femur_right", "of its triangles meet");
}
#else
TEST(SelfIntersections, AreNotLookedAt) {
  EXPECT_FALSE(self_intersections(box({0, 0, 0}, {1, 1, 1}), Context{}));
}
#endif

TEST(Defects, SpecksAndInnerSurfaces) {
  Case patient = small_case();
  const auto add = [&](const SurfaceMesh& more) {
    SurfaceMesh& mesh = patient.skin;
    const Eigen::Index v = mesh.V.rows(), f = mesh.F.rows();
    mesh.V.conservativeResize(v + more.V.rows(), 3);
    mesh.F.conservativeResize(f + more.F.rows(), 3);
    mesh.V.bottomRows(more.V.rows()) = more.V;
    mesh.F.bottomRows(more.F.rows()) = more.F.array() + static_cast<std::int32_t>(v);
  };
  add(box({0, 0, 150}, {0.5, 0.5, 150.5}));
  add(box({-45, -35, -90}, {-30, -30, -80}));
  add(box({-40, -33, -88}, {-35, -32, -82}));
  const SurfaceParts parts = surface_parts(patient.skin);
  ASSERT_EQ(parts.classes.count, 4);
  EXPECT_EQ(parts.largest, 0);
  EXPECT_TRUE(parts.speck(1, speck_mm));
  EXPECT_EQ(parts.parts[1].inside, -1);
  EXPECT_EQ(parts.parts[2].inside, 0);
  EXPECT_EQ(parts.parts[3].inside, 2);  // the innermost around it
  finds(patient, "skin", "1 speck less than 2 mm across");
  finds(patient, "skin", "2 closed parts inside another");
}

TEST(Defects, TheFrameThatAgreesIsNamed) {
  Case patient = small_case();
  // The bones as a file in LSA would hold them, read as LPS.
  Matrix3d lsa;
  lsa << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // columns: where its axes point
  patient.skin.V.col(2).array() += 200;
  for (CaseBone& bone : patient.bones) {
    bone.surface.V.col(2).array() += 200;
    turn(bone.surface, lsa.transpose());
  }
  finds(patient, "bones", "turned (x, y, z) -> (x, -z, y)", "frame: LSA");
  // And in metres: the skin is 200 mm, the bones 0.14.
  Case small = small_case();
  for (CaseBone& bone : small.bones) bone.surface.V *= 0.001;
  finds(small, "bones", "made 1000 times larger", "a unit 1000 times larger");
  Case cm = small_case();
  for (CaseBone& bone : cm.bones) bone.surface.V *= 0.1;
  finds(cm, "bones", "made 10 times larger");
  Case large = small_case();
  large.bones[1].surface.V *= 1000;
  finds(large, "femur_right", "is 9e+04 mm long, the skin 200 mm", "1000 times smaller");
  Case metres = small_case();
  metres.skin.V *= 0.001;
  for (CaseBone& bone : metres.bones) bone.surface.V *= 0.001;
  finds(metres, "skin", "is 0.2 mm long", "1000 times larger it would be 200 mm");
}

TEST(Defects, AgreementIsSilentWhereThereIsNothingToAgree) {
  const Case patient = small_case();
  const Inside skin(patient.skin);
  EXPECT_FALSE(find_agreement(sample_vertices(patient.bones[0].surface, 100), skin, 200));
  EXPECT_FALSE(find_agreement({}, skin, 200));
  EXPECT_EQ(unit_factor(0.2, 100, 3000), 1000);
  EXPECT_EQ(unit_factor(20, 100, 3000), 10);
  EXPECT_EQ(unit_factor(5000, 100, 3000), 0.1);
  EXPECT_EQ(unit_factor(1e9, 100, 3000), 0);
}

TEST(Defects, LabelIds) {
  Case patient = small_case();
  patient.labels->table = {{1, "pelvis_bone"}, {7, "femur_right"}};
  finds(patient, "labels", "no voxel has the id 7 'femur_right'");
  finds(patient, "labels", "1 id of the image is not in the table: 2");
  for (int id = 10; id < 70; ++id) patient.labels->table[id] = "part_" + std::to_string(id);
  finds(
      patient, "labels",
      "no voxel has 61 of the table's 62 ids: 7 'femur_right', 10 'part_10', 11 'part_11', 12 'part_12', 13 "
      "'part_13', ...");
  const auto used = label_ids(patient.labels->image);
  ASSERT_EQ(used.size(), 2u);
  EXPECT_EQ(used.at(2).voxels, 20);
  EXPECT_EQ(used.at(2).first, Vector3d(0, -30, -80));  // voxel (2, 0, 0)
}

TEST(Defects, TissuesFarOutside) {
  Case patient = small_case();
  patient.tissues[0].surface = box({-10, -80, -80}, {10, -12, 10});
  finds(patient, "rectus_femoris", "4 vertices (50 %) outside the skin, by up to 40 mm");
}

}  // namespace
}  // namespace ecorche::check
