// SPDX-License-Identifier: Apache-2.0
// Masks that no scanner makes: closed and manifold all the same.
#include <gtest/gtest.h>

#include <random>

#include "preprocess/label_surfaces/closing.hpp"
#include "preprocess/label_surfaces/hold.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "tests/unit/label_surfaces/bodies.hpp"

namespace ecorche::label_surfaces {
namespace {

using phantom::components;
using phantom::expect_solid;
using phantom::volume;

SurfaceMesh solid(const CaseLabels& labels, const std::string& name) {
  const SurfaceMesh mesh = extract(labels, ids({1}), {});
  expect_solid(mesh, name);
  EXPECT_LE(largest_from_squares(in_index_space(mesh, labels.image.grid), squares(labels, 1)), 0.5) << name;
  return mesh;
}

TEST(LabelMasks, OneVoxel) {
  const SurfaceMesh mesh =
      solid(draw(cube_grid(3), [](int i, int j, int k) { return i == 1 && j == 1 && k == 1; }), "one");
  EXPECT_EQ(components(mesh), 1);
  EXPECT_GT(volume(mesh), 0.1);
}

TEST(LabelMasks, TheWholeImage) {
  const SurfaceMesh mesh = solid(draw(cube_grid(12), [](int, int, int) { return 1; }), "all");
  EXPECT_NEAR(volume(mesh) / 1728, 1, 0.04);
  EXPECT_GE(mesh.V.minCoeff(), -1);
  EXPECT_LE(mesh.V.maxCoeff(), 12);
}

TEST(LabelMasks, PlatesAndRodsOneVoxelThick) {
  const SurfaceMesh plate = solid(draw(cube_grid(16), [](int, int, int k) { return k == 7; }), "plate");
  EXPECT_NEAR(volume(plate) / 256, 1, 0.1);
  solid(draw(cube_grid(16), [](int i, int j, int) { return i == 7 && j == 3; }), "rod");
  solid(draw(cube_grid(16), [](int i, int, int k) { return k == (i * 3) / 4; }), "slanting plate");
  const SurfaceMesh shell = solid(draw(cube_grid(25),
                                       [](int i, int j, int k) {
                                         const double r =
                                             (Eigen::Vector3d(i, j, k) - Eigen::Vector3d(12, 12, 12)).norm();
                                         return r > 9 && r <= 10.5;
                                       }),
                                  "shell");
  EXPECT_EQ(components(shell), 2);
  // A skin whose voxels hang together by their edges alone is one sheet: outside and inside.
  const auto in = [](int i, int j, int k) {
    return (Eigen::Vector3d(i, j, 1.3 * k) - Eigen::Vector3d(12, 12, 15)).norm() <= 9;
  };
  const SurfaceMesh skin =
      solid(draw(cube_grid(25),
                 [&](int i, int j, int k) {
                   return in(i, j, k) && !(in(i - 1, j, k) && in(i + 1, j, k) && in(i, j - 1, k) &&
                                           in(i, j + 1, k) && in(i, j, k - 1) && in(i, j, k + 1));
                 }),
            "thin skin");
  EXPECT_EQ(components(skin), 2);
}

TEST(LabelMasks, VoxelsThatShareAnEdgeAreJoined) {
  const auto two = [](std::array<int, 3> other) {
    return draw(cube_grid(4), [&](int i, int j, int k) {
      return (i == 1 && j == 1 && k == 1) || (i == other[0] && j == other[1] && k == other[2]);
    });
  };
  EXPECT_EQ(components(solid(two({2, 2, 1}), "edge")), 1);
  EXPECT_EQ(components(solid(two({2, 2, 2}), "corner")), 2);
  EXPECT_EQ(components(solid(two({2, 1, 1}), "face")), 1);
}

TEST(LabelMasks, TouchingBalls) {
  const SurfaceMesh mesh = solid(draw(cube_grid(30),
                                      [](int i, int j, int k) {
                                        const Eigen::Vector3d p(i, j, k);
                                        return (p - Eigen::Vector3d(9, 15, 15)).norm() <= 6 ||
                                               (p - Eigen::Vector3d(21.5, 15, 15)).norm() <= 6;
                                      }),
                                 "touching balls");
  EXPECT_LE(components(mesh), 2);
}

TEST(LabelMasks, Checkerboards) {
  solid(draw(cube_grid(7), [](int i, int j, int k) { return (i + j + k) % 2; }), "checkers");
  solid(draw(cube_grid(8), [](int i, int j, int k) { return (i / 2 + j / 2 + k / 2) % 2; }), "checkers of 8");
  solid(draw(cube_grid(7), [](int i, int j, int k) { return 1 - (i + j + k) % 2; }), "the other checkers");
}

TEST(LabelMasks, Noise) {
  std::mt19937 random(3);
  for (int round = 0; round < 60; ++round) {
    const unsigned share = 1 + random() % 9;
    solid(draw(cube_grid(6), [&](int, int, int) { return random() % 10 < share ? 1 : 0; }), "noise");
  }
}

// All 2^8 ways round one corner, and all pairs of neighbouring cells by noise above.
TEST(LabelMasks, EveryCell) {
  for (unsigned bits = 1; bits < 256; ++bits) {
    solid(draw(cube_grid(2), [&](int i, int j, int k) { return bits >> (i + 2 * j + 4 * k) & 1U; }),
          "cell " + std::to_string(bits));
  }
}

TEST(LabelMasks, ALoopBesideAnotherStaysNearerToItsSquares) {
  const Eigen::Vector3d corner(0.5, 0.5, 0.5), far(1.95, 1.95, 1.95);
  SurfaceNet::Home home{{1, 1, 1}, 1U << 0 | 1U << 4 | 1U << 8, 1};  // round the cell's first corner
  const Eigen::Vector3d at(1, 1, 1);
  EXPECT_NEAR((hold(far, home) - at - corner).norm(), 0.45, 1e-12);
  EXPECT_EQ(hold(at + corner, home), at + corner);
  home.alone = 0;
  EXPECT_NEAR((hold(far, home) - at - corner).norm(), 0.2, 1e-12);
}

TEST(LabelMasks, SidesSplitAtThePlane) {
  ImageGrid grid = cube_grid(20);
  grid.origin = {19, 0, 0};
  grid.direction = {-1, 0, 0, 0, -1, 0, 0, 0, 1};  // x falls with i
  const CaseLabels labels =
      draw(grid, [](int i, int, int) { return (i >= 2 && i < 6) || (i >= 12 && i < 18); });
  LabelSource left = ids({1}), right = ids({1});
  left.side = Side::left;
  right.side = Side::right;
  left.plane_mm = right.plane_mm = 9.5;
  const SurfaceMesh l = extract(labels, left, {}), r = extract(labels, right, {});
  EXPECT_NEAR(volume(l), 4 * 400, 60);
  EXPECT_NEAR(volume(r), 6 * 400, 60);
  EXPECT_GT(l.V.col(0).minCoeff(), 13);
  EXPECT_LT(r.V.col(0).maxCoeff(), 8);
  left.plane_mm = right.plane_mm = 15;  // a voxel's centre: it is left
  EXPECT_NEAR(volume(extract(labels, left, {})), 3 * 400, 60);
  EXPECT_NEAR(volume(extract(labels, right, {})), 7 * 400, 60);
}

TEST(LabelMasks, WithinAnotherImage) {
  const CaseLabels labels = ball(cube_grid(21), {10, 10, 10}, 8);
  auto regions = std::make_shared<Image>(labels.image.grid, ScalarType::i16);
  for (std::size_t v = 0; v < labels.image.grid.voxels(); ++v)
    regions->scalars<std::int16_t>()[v] = static_cast<std::int16_t>(v / 441 < 10 ? -5 : 300);
  LabelSource source = ids({1});
  source.within = regions;
  source.within_ids = {-5, 7};
  const SurfaceMesh low = extract(labels, source, {});
  expect_solid(low, "low half");
  EXPECT_LT(low.V.col(2).maxCoeff(), 10);
  source.within_ids = {8};
  EXPECT_EQ(extract(labels, source, {}).F.rows(), 0);
}

TEST(LabelMasks, OverlappingLayersAreLookedAtTogether) {
  const ImageGrid grid = cube_grid(24);
  CaseLabels labels = ball(grid, {8, 12, 12}, 6);
  const CaseLabels other = draw(grid, [](int i, int j, int k) {
    return (Eigen::Vector3d(i, j, k) - Eigen::Vector3d(14, 12, 12)).norm() <= 6 ? 2 : 0;
  });
  labels.overlaps.push_back(other.image);
  const SurfaceMesh second = extract(labels, ids({2}), {});
  expect_solid(second, "second layer");
  EXPECT_NEAR(volume(second), static_cast<double>(count(other, 2)), 20)
      << "whole, also where the first layer covers it";
  EXPECT_NEAR(second.V.col(0).minCoeff(), 8, 1);
  const SurfaceMesh both = extract(labels, ids({1, 2}), {}), all = extract(labels, ids({}), {});
  expect_solid(both, "both");
  EXPECT_EQ(components(both), 1);
  EXPECT_GT(volume(both), volume(second) + 300);
  EXPECT_LT(volume(both), 2 * volume(second) - 100) << "what both cover counts once";
  EXPECT_NEAR(volume(all), volume(both), 1e-6);
}

TEST(LabelMasks, TheOutsideOfEverythingHasNoHollowsAndNoSpecks) {
  const CaseLabels labels = draw(cube_grid(25), [](int i, int j, int k) {
    const double r = (Eigen::Vector3d(i, j, k) - Eigen::Vector3d(12, 12, 12)).norm();
    return r <= 5 ? 9 : r > 7 && r <= 10 ? 3 : i == 0 && j < 2 && k == 3 ? 4 : 0;  // 4: a speck
  });
  EXPECT_EQ(components(extract(labels, ids({3, 4, 9}), {})), 4);
  const SurfaceMesh mesh = extract(labels, ids({}), {});
  expect_solid(mesh, "body");
  EXPECT_EQ(components(mesh), 1);
  EXPECT_NEAR(volume(mesh), 4.0 / 3 * 3.14159265 * 1000, 100);
}

TEST(LabelMasks, AFortiethOfTheBodyIsNoSpeck) {
  const CaseLabels labels = draw(cube_grid(24), [](int i, int j, int k) {
    const bool body = i < 16 && j < 16 && k < 16, apart = i >= 19 && i < 24 && j >= 19 && k >= 20;
    return body || apart;
  });
  EXPECT_EQ(components(extract(labels, ids({}), {})), 2);
}

TEST(LabelMasks, SpecksHaveFewerVoxelsThanTheShare) {
  Mask mask;
  mask.size = {9, 7, 7};
  mask.inside.assign(mask.offset(0, 0, 7), 0);
  for (int k = 1; k < 6; ++k) {
    for (int j = 1; j < 6; ++j) mask.inside[mask.offset(1, j, k)] = 1;  // 25
  }
  mask.inside[mask.offset(4, 3, 3)] = 1;
  mask.inside[mask.offset(7, 3, 3)] = mask.inside[mask.offset(7, 4, 3)] = 1;
  const auto left = [&](double share) {
    Mask out = mask;
    drop_specks(out, share);
    return std::count(out.inside.begin(), out.inside.end(), 1);
  };
  EXPECT_EQ(left(0.04), 28) << "one of 25 is not fewer than a 25th";
  EXPECT_EQ(left(0.05), 27);
  EXPECT_EQ(left(0.09), 25);
}

TEST(LabelMasks, ClosingFillsGapsAndNothingElse) {
  const CaseLabels labels = draw(cube_grid(30), [](int i, int j, int k) {
    return j > 5 && j < 24 && k > 5 && k < 24 && ((i > 4 && i < 13) || (i > 16 && i < 25));  // a gap of 4
  });
  LabelSource source = ids({});
  EXPECT_EQ(components(extract(labels, source, {})), 2);
  source.close_mm = 1.5;
  EXPECT_EQ(components(extract(labels, source, {})), 2);
  source.close_mm = 3;
  const SurfaceMesh mesh = extract(labels, source, {});
  expect_solid(mesh, "closed");
  EXPECT_EQ(components(mesh), 1);
  EXPECT_NEAR(volume(mesh) / (20 * 18 * 18), 1, 0.06);  // the rims of the gap stay round
}

}  // namespace
}  // namespace ecorche::label_surfaces
