// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "phantom/isosurface.hpp"
#include "phantom/random.hpp"
#include "phantom/simplify.hpp"
#include "tests/unit/phantom/mesh_checks.hpp"

namespace ecorche::phantom {
namespace {

constexpr double kPi = 3.14159265358979323846;

TEST(Isosurface, SphereConvergesAtSecondOrder) {
  const Shape ball = sphere({1, 2, 3}, 20);
  const double true_volume = 4.0 / 3 * kPi * 8000, true_area = 4 * kPi * 400;
  double last_volume = 0, last_area = 0;
  for (const double h : {8.0, 4.0, 2.0, 1.0}) {
    const SurfaceMesh mesh = isosurface(ball, h, {});
    expect_solid(mesh, "sphere");
    const double volume_error = std::abs(volume(mesh) / true_volume - 1),
                 area_error = std::abs(area(mesh) / true_area - 1);
    std::printf("spacing %g: %ld vertices, volume error %.2e, area error %.2e\n", h,
                static_cast<long>(mesh.V.rows()), volume_error, area_error);
    if (last_volume > 0) {
      EXPECT_GT(std::log2(last_volume / volume_error), 1.7);
      EXPECT_GT(std::log2(last_area / area_error), 1.7);
    }
    last_volume = volume_error;
    last_area = area_error;
  }
}

TEST(Isosurface, VerticesLieOnTheSurface) {
  const Shape shape = unite({ellipsoid({0, 0, 0}, {30, 18, 12}), sphere({20, 10, 5}, 14)}, 8);
  const SurfaceMesh mesh = isosurface(shape, 2, {});
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v)
    EXPECT_NEAR(shape.distance(mesh.V.row(v).transpose()), 0, 0.02);
}

TEST(Isosurface, IsManifoldWhateverTheTopology) {
  // Foam, far below the lattice's resolution: full of ambiguous squares.
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    std::vector<Shape> balls;
    for (std::uint64_t i = 0; i < 120; ++i) {
      balls.push_back(
          sphere({60 * uniform(seed, 4 * i), 60 * uniform(seed, 4 * i + 1), 60 * uniform(seed, 4 * i + 2)},
                 2 + 4 * uniform(seed, 4 * i + 3)));
    }
    const SurfaceMesh mesh = isosurface(unite(balls), 3, {});
    std::set<std::pair<int, int>> edges;
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
      for (int c = 0; c < 3; ++c) ASSERT_TRUE(edges.emplace(mesh.F(f, c), mesh.F(f, (c + 1) % 3)).second);
    }
    for (const auto& [a, b] : edges) ASSERT_TRUE(edges.count({b, a}));
    EXPECT_GT(volume(mesh), 0);
  }
}

TEST(Isosurface, TorusHasOneHole) {
  std::vector<Vec> ring;
  for (int i = 0; i <= 48; ++i)
    ring.emplace_back(20 * std::cos(2 * kPi * i / 48), 20 * std::sin(2 * kPi * i / 48), 0);
  const SurfaceMesh mesh = isosurface(chain(ring, std::vector<double>(ring.size(), 6)), 2, {});
  expect_solid(mesh, "torus");
  EXPECT_EQ(mesh.V.rows() - mesh.F.rows() / 2, 0);  // Euler characteristic
  EXPECT_EQ(components(mesh), 1);
}

TEST(Isosurface, SameBytesOnAnyNumberOfThreads) {
  const Shape shape = unite({ellipsoid({0, 0, 0}, {30, 18, 12}), sphere({20, 10, 5}, 14)}, 8);
  SurfaceMesh one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = isosurface(shape, 1.5, {});
  }
  const SurfaceMesh many = isosurface(shape, 1.5, {});
  EXPECT_EQ(one.V, many.V);
  EXPECT_EQ(one.F, many.F);
}

TEST(Isosurface, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  EXPECT_THROW(isosurface(sphere({0, 0, 0}, 20), 1, context), Error);
}

TEST(Isosurface, SaysWhenTheLatticeMissesTheShape) {
  try {
    isosurface(sphere({0, 0, 0}, 0.5), 10, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(error.problem().find("a shape has no surface at spacing 10"), std::string::npos)
        << error.what();
  }
}

TEST(Simplify, KeepsTheSolid) {
  const Shape shape = unite({ellipsoid({0, 0, 0}, {30, 18, 12}), sphere({20, 10, 5}, 14)}, 8);
  const SurfaceMesh fine = isosurface(shape, 1.5, {});
  const SurfaceMesh coarse = simplify(fine, 150);
  expect_solid(coarse, "simplified");
  EXPECT_LE(coarse.V.rows(), 150);
  EXPECT_GT(coarse.V.rows(), 140);
  EXPECT_NEAR(volume(coarse) / volume(fine), 1, 0.025);
  EXPECT_EQ(coarse.V.rows() - coarse.F.rows() / 2, 2);
}

}  // namespace
}  // namespace ecorche::phantom
