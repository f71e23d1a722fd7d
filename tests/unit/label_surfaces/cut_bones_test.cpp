// SPDX-License-Identifier: Apache-2.0
// Bones of a CT: a template found in a scan, bones parted where they touch, marrow filled.
#include <gtest/gtest.h>

#include <random>

#include "preprocess/scan/cut_bones.hpp"
#include "preprocess/scan/place_template.hpp"

namespace ecorche::scan {
namespace {

ImageGrid grid_of(int i, int j, int k, double mm = 1) {
  ImageGrid grid;
  grid.size = {i, j, k};
  grid.spacing = {mm, mm, mm};
  return grid;
}

// The slow and obvious twin: for each label the shallowest step of the deepest way to every voxel, by
// relaxing until nothing changes.
std::vector<double> widest_way(const std::vector<std::uint8_t>& mask, const std::vector<float>& depth,
                               const ImageGrid& grid, const std::vector<std::uint16_t>& seeds,
                               std::uint16_t label) {
  std::vector<double> best(mask.size(), -1);
  for (std::size_t v = 0; v < best.size(); ++v) {
    if (seeds[v] == label) best[v] = std::floor(static_cast<double>(depth[v]));
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) {
          const std::size_t v = grid.offset(i, j, k);
          if (mask[v] == 0 || seeds[v] != 0) continue;
          for (int d = 0; d < 27; ++d) {
            const int di = d % 3 - 1, dj = d / 3 % 3 - 1, dk = d / 9 - 1;
            if (std::abs(di) + std::abs(dj) + std::abs(dk) > 2) continue;
            const int x = i + di, y = j + dj, z = k + dk;
            if (x < 0 || y < 0 || z < 0 || x >= grid.size[0] || y >= grid.size[1] || z >= grid.size[2])
              continue;
            const double way =
                std::min(best[grid.offset(x, y, z)], std::floor(static_cast<double>(depth[v])));
            if (way > best[v]) best[v] = way, changed = true;
          }
        }
      }
    }
  }
  return best;
}

TEST(Watershed, GivesEachVoxelTheLabelWithTheWidestWay) {
  std::mt19937 random(5);
  int decided = 0;
  for (int round = 0; round < 40; ++round) {
    const ImageGrid grid = grid_of(8, 7, 6);
    std::vector<std::uint8_t> mask(grid.voxels());
    std::vector<float> depth(grid.voxels());
    std::vector<std::uint16_t> seeds(grid.voxels(), 0);
    for (std::size_t v = 0; v < mask.size(); ++v) {
      mask[v] = random() % 4 != 0 ? 1 : 0;
      depth[v] = static_cast<float>(random() % 7);
      if (mask[v] != 0 && random() % 60 == 0) seeds[v] = static_cast<std::uint16_t>(1 + random() % 3);
    }
    std::vector<std::uint16_t> of = seeds;
    watershed(mask, depth, grid.size, 1, of, {});
    std::array<std::vector<double>, 3> ways;
    for (std::uint16_t label = 1; label <= 3; ++label)
      ways[label - 1U] = widest_way(mask, depth, grid, seeds, label);
    for (std::size_t v = 0; v < of.size(); ++v) {
      if (seeds[v] != 0 || mask[v] == 0) {
        EXPECT_EQ(of[v], seeds[v]);
        continue;
      }
      const double most = std::max({ways[0][v], ways[1][v], ways[2][v]});
      if (most < 0) {
        EXPECT_EQ(of[v], 0) << "no seed reaches it";
        continue;
      }
      ASSERT_NE(of[v], 0);
      EXPECT_EQ(ways[of[v] - 1U][v], most);
      ++decided;
    }
  }
  EXPECT_GT(decided, 3000);
}

TEST(Hollows, AreFilledWhereOneBoneEnclosesThemAndTheyAreSmall) {
  const ImageGrid grid = grid_of(20, 9, 1);
  std::vector<std::uint16_t> of(grid.voxels(), 0);
  const auto ring = [&](int from, int to, std::uint16_t id) {
    for (int j = 1; j <= 7; ++j) {
      for (int i = from; i <= to; ++i) {
        if (i == from || i == to || j == 1 || j == 7) of[grid.offset(i, j, 0)] = id;
      }
    }
  };
  ring(1, 5, 1);    // 15 mm^2 within
  ring(7, 11, 2);   // the same, but it may fill 10 only
  ring(13, 17, 1);  // two bones
  of[grid.offset(13, 4, 0)] = 2;
  fill_hollows(of, grid, {20, 10});
  EXPECT_EQ(of[grid.offset(3, 4, 0)], 1);
  EXPECT_EQ(of[grid.offset(9, 4, 0)], 0);
  EXPECT_EQ(of[grid.offset(15, 4, 0)], 0);
  EXPECT_EQ(of[grid.offset(0, 0, 0)], 0);
}

TEST(SimilarityFit, FindsTheSimilarityThatMadeThePoints) {
  Similarity made{
      1.2, Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(), {10, -20, 30}};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-50, 50);
  SimilarityFit fit;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector3d p(place(random), place(random), place(random));
    fit.add(p, made(p), 1 + i % 3);
  }
  const Similarity found = fit.solve(0.5, 2);
  EXPECT_NEAR(found.scale, 1.2, 1e-9);
  EXPECT_LT((found.rotation - made.rotation).norm(), 1e-9);
  EXPECT_LT((found.shift - made.shift).norm(), 1e-7);
  EXPECT_EQ(fit.solve(0.5, 1.1).scale, 1.1);
  const Eigen::Vector3d p(1, 2, 3);
  EXPECT_LT((inverse(made)(made(p)) - p).norm(), 1e-9);
  EXPECT_LT((made.back(made(p)) - p).norm(), 1e-9);
}

// A trunk, a head on it and two limbs: blocks that no two of them have alike.
struct Block {
  const char* name;
  const char* segment;
  int parent;
  Eigen::Vector3d low, high, joint;
};
const std::vector<Block>& blocks() {
  static const std::vector<Block> all{
      {"pelvis", "pelvis", -1, {-60, -30, 0}, {60, 30, 90}, {0, 0, 45}},
      {"rib_cage", "thorax", 0, {-40, -25, 96}, {40, 25, 220}, {0, 0, 93}},
      {"skull", "head", 1, {-30, -45, 226}, {30, 45, 300}, {0, 0, 223}},
      {"femur_left", "thigh_left", 0, {25, -14, -220}, {53, 14, -6}, {39, 0, -3}},
      {"femur_right", "thigh_right", 0, {-53, -14, -220}, {-25, 14, -6}, {-39, 0, -3}}};
  return all;
}

BodyTemplate block_template() {
  BodyTemplate out;
  for (const Block& block : blocks()) {
    out.segments.push_back({block.segment, block.parent, block.joint});
    std::vector<Eigen::Vector3d> shell;
    const auto count = [&](int axis) {
      return static_cast<int>(std::ceil((block.high[axis] - block.low[axis] - 2) / 7));
    };
    for (int z = 0; z < count(2); ++z) {
      for (int y = 0; y < count(1); ++y) {
        for (int x = 0; x < count(0); ++x) {
          const Eigen::Vector3d p = block.low + Eigen::Vector3d(2 + 7 * x, 2 + 7 * y, 2 + 7 * z);
          if (std::min((p - block.low).minCoeff(), (block.high - p).minCoeff()) < 6) shell.push_back(p);
        }
      }
    }
    Points points(static_cast<Eigen::Index>(shell.size()), 3);
    for (std::size_t p = 0; p < shell.size(); ++p)
      points.row(static_cast<Eigen::Index>(p)) = shell[p].transpose();
    out.bones.push_back({block.name, static_cast<int>(out.bones.size()), std::move(points), 0});
  }
  return out;
}

// The blocks at 1.07 of their size, moved, their joints bridged by narrow bone; of each voxel its block + 1.
std::vector<std::uint16_t> block_scan(const ImageGrid& grid, std::vector<std::uint8_t>& mask) {
  std::vector<std::uint16_t> truth(grid.voxels(), 0);
  mask.assign(grid.voxels(), 0);
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto at = grid.point(i, j, k);
        const Eigen::Vector3d p = (Eigen::Vector3d(at[0], at[1], at[2]) - Eigen::Vector3d(9, -4, 6)) / 1.07;
        const std::size_t v = grid.offset(i, j, k);
        for (std::size_t b = 0; b < blocks().size(); ++b) {
          const Block& block = blocks()[b];
          if ((p - block.low).minCoeff() > 0 && (block.high - p).minCoeff() > 0)
            truth[v] = static_cast<std::uint16_t>(b + 1), mask[v] = 1;
          if (b > 0 && (p - block.joint).cwiseAbs().maxCoeff() < 5) mask[v] = 1;
        }
      }
    }
  }
  return truth;
}

TEST(CutBones, PartsTouchingBonesOfAPartOfABody) {
  ImageGrid grid = grid_of(56, 42, 60, 3);  // from mid-thigh to the chest
  grid.origin = {-75, -65, -60};
  std::vector<std::uint8_t> mask;
  const std::vector<std::uint16_t> truth = block_scan(grid, mask);
  const BodyTemplate body = block_template();
  const std::vector<Placed> found = place_template(body, spread_points(mask, grid, 8), grid, Side::both, {});
  ASSERT_FALSE(found.empty());
  EXPECT_FALSE(one_limb(found.front().view));
  EXPECT_LT(found.front().misfit, 0.25);
  const CutBones cut = cut_bones(mask, grid, body, found.front(), {});
  std::size_t bone = 0, right = 0, skull = 0;
  for (std::size_t v = 0; v < truth.size(); ++v) {
    if (truth[v] == 0) continue;
    ++bone;
    right += cut.of[v] == truth[v] ? 1 : 0;
    skull += cut.of[v] == 3 ? 1 : 0;
  }
  EXPECT_GT(static_cast<double>(right), 0.97 * static_cast<double>(bone));
  EXPECT_EQ(skull, 0U) << "it is not in view";
  for (const std::size_t b : {0U, 1U, 3U, 4U}) EXPECT_GT(cut.bones[b].agreement, 0.85) << b;
}

// Arms that hang beside the trunk of the template, and are not in the scan, take none of its bones.
TEST(PlaceTemplate, LeavesOutArmsThatAreNotThere) {
  BodyTemplate body = block_template();
  body.segments.push_back({"upper_arm_left", 1, {60, 0, 215}});
  Points points(0, 3);
  std::vector<Eigen::Vector3d> shell;
  for (int z = 20; z < 215; z += 7) {
    for (int a = 0; a < 5; ++a) shell.emplace_back(64 + 10 * std::cos(1.2 * a), 10 * std::sin(1.2 * a), z);
  }
  points.resize(static_cast<Eigen::Index>(shell.size()), 3);
  for (std::size_t p = 0; p < shell.size(); ++p)
    points.row(static_cast<Eigen::Index>(p)) = shell[p].transpose();
  body.bones.push_back({"humerus_left", 5, points, 0});
  ImageGrid grid = grid_of(70, 42, 100, 3);
  grid.origin = {-95, -65, -60};
  std::vector<std::uint8_t> mask;
  block_scan(grid, mask);
  const auto places = place_template(body, spread_points(mask, grid, 8), grid, Side::both, {});
  ASSERT_FALSE(places.empty());
  EXPECT_EQ(places.front().in_play, (std::vector<std::uint8_t>{1, 1, 1, 1, 1, 0}));
  const CutBones cut = cut_bones(mask, grid, body, places.front(), {});
  EXPECT_EQ(cut.bones[5].voxels, 0U);
  // With an arm of its own the scan keeps it.
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto at = grid.point(i, j, k);
        const Eigen::Vector3d p = (Eigen::Vector3d(at[0], at[1], at[2]) - Eigen::Vector3d(9, -4, 6)) / 1.07;
        const double r = std::hypot(p[0] - 90, p[1]);
        if (r < 12 && p[2] > 20 && p[2] < 215) mask[grid.offset(i, j, k)] = 1;
      }
    }
  }
  const auto with = place_template(body, spread_points(mask, grid, 8), grid, Side::both, {});
  EXPECT_EQ(with.front().in_play, (std::vector<std::uint8_t>{1, 1, 1, 1, 1, 1}));
  EXPECT_GT(cut_bones(mask, grid, body, with.front(), {}).bones[5].voxels, 500U);
}

TEST(CutBones, WithASideOnlyALimbOfItIsLookedFor) {
  ImageGrid grid = grid_of(24, 24, 60, 3);
  grid.origin = {15, -40, -205};  // the left thigh alone
  std::vector<std::uint8_t> mask;
  block_scan(grid, mask);
  const Points points = spread_points(mask, grid, 8);
  const BodyTemplate body = block_template();
  for (const Placed& placed : place_template(body, points, grid, Side::left, {})) {
    EXPECT_EQ(placed.view, View::leg_left);
    EXPECT_EQ(placed.in_play, (std::vector<std::uint8_t>{0, 0, 0, 1, 0}));
  }
}

TEST(CutBones, OfNothingAreNone) {
  const ImageGrid grid = grid_of(4, 4, 4);
  Placed placed;
  placed.segments.resize(5);
  placed.in_play.assign(5, 1);
  const CutBones cut =
      cut_bones(std::vector<std::uint8_t>(grid.voxels(), 0), grid, block_template(), placed, {});
  EXPECT_EQ(cut.left_out, 0U);
  for (const FoundBone& bone : cut.bones) EXPECT_EQ(bone.voxels, 0U);
}

}  // namespace
}  // namespace ecorche::scan
