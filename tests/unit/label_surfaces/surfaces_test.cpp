// SPDX-License-Identifier: Apache-2.0
// Surfaces of bodies that formulas know: volume, distance, smoothness, frames.
#include <gtest/gtest.h>

#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "tests/unit/label_surfaces/bodies.hpp"

namespace ecorche::label_surfaces {
namespace {

using Eigen::Vector3d;
using phantom::expect_solid;
using phantom::volume;

void expect_within_half_a_voxel(const SurfaceMesh& mesh, const CaseLabels& labels, int id = 1) {
  EXPECT_LE(largest_from_squares(in_index_space(mesh, labels.image.grid), squares(labels, id)), 0.5);
}

TEST(LabelSurfaces, BallsAreSmoothAndKeepTheirVolume) {
  for (const double radius : {5.0, 10.0, 20.0}) {
    const int n = static_cast<int>(2 * radius) + 7;
    const CaseLabels labels = ball(cube_grid(n), Vector3d::Constant(n / 2 + 0.13), radius);
    const SurfaceMesh mesh = extract(labels, ids({1}), {});
    expect_solid(mesh, "ball");
    const auto voxels = static_cast<double>(count(labels, 1));
    const Creases c = creases(mesh);
    std::printf("ball of %g voxels: volume %+.2f %% of its voxels', creases %.1f mean, %.1f largest deg\n",
                radius, 100 * (volume(mesh) / voxels - 1), c.mean_deg, c.largest_deg);
    EXPECT_NEAR(volume(mesh) / voxels, 1, radius < 8 ? 0.04 : 0.02);
    // The staircase has 90 degrees at every step; the ball itself about 57 / radius from vertex to vertex.
    EXPECT_LT(c.mean_deg, 57 / radius + 1);
    EXPECT_LT(c.largest_deg, 25);
    expect_within_half_a_voxel(mesh, labels);
    double worst = 0;
    for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
      const double r = (mesh.V.row(v).transpose() - Vector3d::Constant(n / 2 + 0.13)).norm();
      worst = std::max(worst, std::abs(r - radius));
    }
    EXPECT_LT(worst, 0.6);
  }
}

TEST(LabelSurfaces, EverySquareHasTheSurfaceNear) {
  const CaseLabels labels = ball(cube_grid(19), Vector3d(9, 9, 9), 7);
  const SurfaceMesh mesh = extract(labels, ids({1}), {});
  double worst = 0;
  for (const Square& s : squares(labels, 1)) {
    const Vector3d p = (s.low + s.high) / 2;
    double best = 1e300;
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {  // the slow way: samples of every triangle
      for (int a = 0; a <= 4; ++a) {
        for (int b = 0; a + b <= 4; ++b) {
          const Vector3d q = (a * phantom::corner(mesh, f, 0) + b * phantom::corner(mesh, f, 1) +
                              (4 - a - b) * phantom::corner(mesh, f, 2)) /
                             4;
          best = std::min(best, (p - q).squaredNorm());
        }
      }
    }
    worst = std::max(worst, std::sqrt(best));
  }
  EXPECT_LT(worst, 0.55);  // half a voxel and the samples' own distance
}

TEST(LabelSurfaces, EllipsoidAndBoxInAnyFrame) {
  const Eigen::Matrix3d oblique = Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  Eigen::Matrix3d mirrored = oblique;
  mirrored.col(2) *= -1;
  for (const Eigen::Matrix3d& axes : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), oblique, mirrored}) {
    ImageGrid grid = cube_grid(40);
    grid.spacing = {1.775, 0.6, 4.84};
    grid.origin = {-300, 20, 1000};
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(grid.direction.data()) = axes;
    const CaseLabels labels = draw(grid, [](int i, int j, int k) {
      const double x = (i - 12) / 10.0, y = (j - 19) / 15.0, z = (k - 14) / 12.0;
      if (x * x + y * y + z * z <= 1) return 1;
      return i >= 26 && i < 38 && j >= 10 && j < 30 && k >= 15 && k < 27 ? 2 : 0;
    });
    const double voxel = 1.775 * 0.6 * 4.84;
    for (const int id : {1, 2}) {
      const SurfaceMesh mesh = extract(labels, ids({id}), {});
      expect_solid(mesh, "in a frame");  // also: volume above 0, so the triangles face out
      EXPECT_NEAR(volume(mesh) / (voxel * static_cast<double>(count(labels, id))), 1, 0.02);
      expect_within_half_a_voxel(mesh, labels, id);
    }
    const SurfaceMesh box = extract(labels, ids({2}), {});
    const auto middle = grid.point(31.5, 19.5, 20.5);
    const Vector3d mean = box.V.colwise().mean().transpose();
    EXPECT_LT((mean - Vector3d(middle[0], middle[1], middle[2])).norm(), 0.05);
  }
}

TEST(LabelSurfaces, NeighboursAgreeWhereTheyTouch) {
  // A ball of two labels: the surfaces of both along the plane between them.
  const CaseLabels labels = draw(cube_grid(49), [](int i, int j, int k) {
    return (Vector3d(i, j, k) - Vector3d(24, 24, 24)).norm() > 20 ? 0 : i + 0.35 * j + 0.2 * k < 37 ? 1 : 2;
  });
  const SurfaceMesh one = extract(labels, ids({1}), {}), two = extract(labels, ids({2}), {});
  double sum = 0, worst = 0;
  int shared = 0;
  for (Eigen::Index v = 0; v < one.V.rows(); ++v) {
    const Vector3d p = one.V.row(v).transpose();
    if (std::abs(p[0] + 0.35 * p[1] + 0.2 * p[2] - 37) > 1 || (p - Vector3d(24, 24, 24)).norm() > 17)
      continue;
    const double d = std::sqrt((two.V.rowwise() - p.transpose()).rowwise().squaredNorm().minCoeff());
    sum += d;
    worst = std::max(worst, d);
    ++shared;
  }
  ASSERT_GT(shared, 300);
  std::printf("between neighbours: %.3f voxels mean, %.3f largest over %d vertices\n", sum / shared, worst,
              shared);
  EXPECT_LT(sum / shared, 0.08);
  EXPECT_LT(worst, 0.4);  // by the rim, which is one body's edge and the other's too
}

TEST(LabelSurfaces, ShallowSlopesHaveNoTerraces) {
  // A plane that rises by one voxel over ten: its steps vanish.
  const CaseLabels labels =
      draw(cube_grid(64), [](int i, int j, int k) { return k < 10 + 0.1 * i + 0.07 * j; });
  const SurfaceMesh mesh = extract(labels, ids({1}), {});
  double worst = 0;
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
    const Vector3d p = mesh.V.row(v).transpose();
    if (p[0] < 8 || p[0] > 55 || p[1] < 8 || p[1] > 55 || p[2] < 5) continue;
    worst = std::max(worst, std::abs(p[2] - (10 + 0.1 * p[0] + 0.07 * p[1])));
  }
  std::printf("a slope of 1 in 10: off its plane by at most %.2f voxels\n", worst);
  EXPECT_LT(worst, 0.2);  // the staircase's is 0.5
}

}  // namespace
}  // namespace ecorche::label_surfaces
