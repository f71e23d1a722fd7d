// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/round_trip.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// Two blocks of 4 x 4 x 4 mm side by side, six tets each, 20 mm apart; voxels of 1 mm.
struct Blocks {
  PointsF rest{16, 3}, posed;
  Tets tets{12, 4};
  ImageGrid grid;

  Blocks() {
    const int kuhn[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                            {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
    for (int b = 0; b < 2; ++b) {
      for (int c = 0; c < 8; ++c)
        rest.row(8 * b + c) << static_cast<float>(4 * (c & 1) + 20 * b), static_cast<float>(2 * (c & 2)),
            static_cast<float>(c & 4);
      for (int t = 0; t < 6; ++t) {
        for (int c = 0; c < 4; ++c) tets(6 * b + t, c) = 8 * b + kuhn[t][c];
      }
    }
    posed = rest;
    grid.size = {26, 6, 6};
    grid.origin = {-0.5, -0.5, -0.5};
  }
  Deformation body() const {
    return {tets,
            {rest.data(), static_cast<std::size_t>(rest.size())},
            {posed.data(), static_cast<std::size_t>(posed.size())}};
  }
  VoxelTrip trip() const {
    InverseMap scan, shown;
    locate(body().back(), grid, scan);
    locate(body(), grid, shown);
    return voxel_trip(body(), scan, shown, {});
  }
};

TEST(VoxelTrip, AMotionWithoutOverlapForgetsNothing) {
  Blocks blocks;
  blocks.posed.bottomRows(8).col(0).array() -= 8.25F;
  blocks.posed.col(1).array() += 0.5F;
  const VoxelTrip trip = blocks.trip();
  EXPECT_EQ(trip.voxels, 128u);
  EXPECT_EQ(trip.elsewhere, 0u);
  EXPECT_LT(trip.max_mm, 1e-9);
}

// The second block lands in the first, of which the image shows the lower index: half of the body is lost.
TEST(VoxelTrip, WhatLiesUnderAnotherComesBackAsTheOther) {
  Blocks blocks;
  blocks.posed.bottomRows(8) = blocks.rest.topRows(8);
  blocks.grid.spacing = {1, 1, 1};
  const VoxelTrip trip = blocks.trip();
  EXPECT_EQ(trip.voxels, 128u);
  EXPECT_EQ(trip.elsewhere, 64u);
  EXPECT_NEAR(trip.mean_mm, 10, 1e-5);
  EXPECT_NEAR(trip.mean_voxels, 10, 1e-5);
  EXPECT_NEAR(trip.max_mm, 20, 1e-5);
  std::size_t lost = 0;
  for (int k = 0; k < 6; ++k) {
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 26; ++i) {
        if (trip.lost[blocks.grid.offset(i, j, k)] == 0) continue;
        ++lost;
        EXPECT_GE(i, 20);
      }
    }
  }
  EXPECT_EQ(lost, 64u);
}

TEST(VoxelTrip, WhatLeftTheImageIsLost) {
  Blocks blocks;
  blocks.posed.bottomRows(8).col(2).array() += 100;
  const VoxelTrip trip = blocks.trip();
  EXPECT_EQ(trip.elsewhere, 64u);
  EXPECT_EQ(trip.mean_mm, 0) << "over those that have a value";
}

// The slow twin: each voxel by itself, in barycentric coordinates; threads change nothing.
TEST(VoxelTrip, IsThatOfEachVoxelByItself) {
  Blocks blocks;
  for (Eigen::Index n = 0; n < 16; ++n) {
    const float x = blocks.rest(n, 0);
    blocks.posed(n, 0) = x > 10 ? x - 18.3F : x;
    blocks.posed(n, 1) += 0.1F * x;
    blocks.posed(n, 2) *= 1.3F;
  }
  blocks.grid.spacing = {1, 0.7, 0.9};
  InverseMap scan, shown;
  locate(blocks.body().back(), blocks.grid, scan);
  locate(blocks.body(), blocks.grid, shown);
  const auto through = [&](const PointsF& from, const PointsF& to, std::int32_t tet, const Vector3d& p) {
    Eigen::Matrix4d corners;
    for (int c = 0; c < 4; ++c) corners.col(c) << from.row(blocks.tets(tet, c)).transpose().cast<double>(), 1;
    const Eigen::Vector4d share = corners.inverse() * Eigen::Vector4d(p.x(), p.y(), p.z(), 1);
    Vector3d out = Vector3d::Zero();
    for (int c = 0; c < 4; ++c) out += share[c] * to.row(blocks.tets(tet, c)).transpose().cast<double>();
    return out;
  };
  std::uint64_t voxels = 0, elsewhere = 0, found = 0;
  double sum = 0;
  for (int k = 0; k < 6; ++k) {
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 26; ++i) {
        const std::int32_t tet = scan.tet[blocks.grid.offset(i, j, k)];
        if (tet < 0) continue;
        ++voxels;
        const auto at = blocks.grid.point(i, j, k);
        const Vector3d x(at[0], at[1], at[2]), y = through(blocks.rest, blocks.posed, tet, x);
        const auto index = blocks.grid.index({y.x(), y.y(), y.z()});
        int v[3];
        bool inside = true;
        for (std::size_t a = 0; a < 3; ++a) {
          v[a] = static_cast<int>(std::floor(index[a] + 0.5));
          inside = inside && v[a] >= 0 && v[a] < blocks.grid.size[a];
        }
        const std::int32_t other = inside ? shown.tet[blocks.grid.offset(v[0], v[1], v[2])] : -1;
        if (other < 0) {
          ++elsewhere;
          continue;
        }
        const Vector3d away = through(blocks.posed, blocks.rest, other, y) - x;
        elsewhere += away.cwiseQuotient(Vector3d(1, 0.7, 0.9)).norm() > 1 ? 1 : 0;
        ++found;
        sum += away.norm();
      }
    }
  }
  for (const std::size_t threads : {1, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const VoxelTrip trip = voxel_trip(blocks.body(), scan, shown, {});
    EXPECT_EQ(trip.voxels, voxels);
    EXPECT_EQ(trip.elsewhere, elsewhere);
    EXPECT_NEAR(trip.mean_mm, sum / static_cast<double>(found), 1e-9);
  }
  EXPECT_GT(elsewhere, 10u);
  EXPECT_LT(elsewhere, voxels);
}

}  // namespace
}  // namespace ecorche::runtime
