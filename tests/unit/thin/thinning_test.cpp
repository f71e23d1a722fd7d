// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/thinning.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "tests/unit/thin/brute_force.hpp"

namespace ecorche::thin {
namespace {

constexpr DistanceMetric kMetrics[] = {DistanceMetric::euclidean, DistanceMetric::chamfer345};

VolumetricSkeleton skeleton(const Mask& mask, double thinness,
                            DistanceMetric metric = DistanceMetric::euclidean) {
  return thin(distance_map(mask, metric, {}), mask.grid, thinness, {});
}

void expect_equal(const VolumetricSkeleton& a, const VolumetricSkeleton& b) {
  EXPECT_EQ(a.voxel, b.voxel);
  EXPECT_EQ(a.distance, b.distance);
  EXPECT_EQ(a.deficit, b.deficit);  // every bit: no value here is NaN or -0 beside 0
  EXPECT_EQ(a.thinness, b.thinness);
  EXPECT_EQ(a.metric, b.metric);
  EXPECT_EQ(a.grid, b.grid);
}

Mask lumps() {  // a ball, a bar and a sheet that touch each other, and the image's border
  return make_mask({43, 37, 70}, [](int i, int j, int k) {
    const bool ball = (i - 15) * (i - 15) + (j - 17) * (j - 17) + (k - 14) * (k - 14) < 140;
    return ball || (i > 10 && i < 19 && j > 12 && j < 24 && k > 12) || (k > 40 && k < 44);
  });
}

TEST(Thinning, DeficitIsOwnDistanceMinusTheNeighboursMean) {
  for (const DistanceMetric metric : kMetrics) {
    const Mask mask = lumps();
    const DistanceMap map = distance_map(mask, metric, {});
    const auto& n = map.size;
    const auto length = [&](int i, int j, int k) {
      if (i < 0 || j < 0 || k < 0 || i >= n[0] || j >= n[1] || k >= n[2]) return 0.0;
      const double v = map.at(mask.grid.offset(i, j, k));
      return metric == DistanceMetric::euclidean ? std::sqrt(v) : v / 3;
    };
    for (const double tp : {-0.05, 0.0, 0.3, 0.48, 0.9}) {
      const VolumetricSkeleton s = thin(map, mask.grid, tp, {});
      std::size_t row = 0;
      for (int k = 0; k < n[2]; ++k) {
        for (int j = 0; j < n[1]; ++j) {
          for (int i = 0; i < n[0]; ++i) {
            if (length(i, j, k) == 0) continue;
            double sum = 0;
            for (int d = 0; d < 27; ++d) sum += length(i + d % 3 - 1, j + d / 3 % 3 - 1, k + d / 9 - 1);
            const double deficit = length(i, j, k) - (sum - length(i, j, k)) / 26;
            const bool here =
                row < s.size() && s.voxel[row] == std::array<std::uint16_t, 3>{static_cast<std::uint16_t>(i),
                                                                               static_cast<std::uint16_t>(j),
                                                                               static_cast<std::uint16_t>(k)};
            // Floats round sums of up to 27 distances: within 1e-5 of the threshold either is right.
            if (std::abs(deficit - tp) > 1e-5) {
              ASSERT_EQ(here, deficit > tp) << i << " " << j << " " << k;
            }
            if (!here) continue;
            EXPECT_NEAR(s.deficit[row], deficit, 1e-5);
            EXPECT_EQ(s.distance[row], map.at(mask.grid.offset(i, j, k)));
            ++row;
          }
        }
      }
      EXPECT_EQ(row, s.size());
    }
  }
}

TEST(Thinning, ExactWhereDistancesAreWholeNumbers) {
  // A slab of 9 between two half spaces: distances 1 2 3 4 5 4 3 2 1, so the middle sheet alone is above the
  // mean of its neighbours, by 18 / 26; far from the image's border.
  const Mask mask = make_mask({40, 40, 11}, [](int, int, int k) { return k > 0 && k < 10; });
  const VolumetricSkeleton s = skeleton(mask, 0.0);
  for (std::size_t r = 0; r < s.size(); ++r) {
    const auto& v = s.voxel[r];
    if (v[0] < 8 || v[0] > 31 || v[1] < 8 || v[1] > 31) continue;
    EXPECT_EQ(v[2], 5);
    EXPECT_EQ(s.distance[r], 25U);
    EXPECT_EQ(s.deficit[r], 5.0F - (5 * 8 + 4 * 18) / 26.0F);
  }
}

TEST(Thinning, AThinnerSkeletonOutOfAThickerOneIsAFreshOne) {
  std::vector<Mask> masks{lumps(), ellipsoid({40, 30, 50}, {18, 13, 23}), random_mask({31, 29, 37}, 0.95, 4)};
  for (const Mask& mask : masks) {
    for (const DistanceMetric metric : kMetrics) {
      const DistanceMap map = distance_map(mask, metric, {});
      const VolumetricSkeleton thick = thin(map, mask.grid, least_thinness, {});
      std::size_t last = thick.size();
      for (double tp = -0.3; tp < 1.2; tp += 0.07) {
        const VolumetricSkeleton fresh = thin(map, mask.grid, tp, {});
        expect_equal(thinner(thick, tp), fresh);
        expect_equal(thinner(thinner(thick, tp - 0.04), tp), fresh);
        EXPECT_LE(fresh.size(), last);  // nested, so never more
        last = fresh.size();
      }
      // Thresholds that deficits stand on exactly: not above is not kept.
      for (std::size_t r = 0; r < thick.size(); r += thick.size() / 20 + 1) {
        const double tp = static_cast<double>(thick.deficit[r]);
        const VolumetricSkeleton fresh = thin(map, mask.grid, tp, {});
        expect_equal(thinner(thick, tp), fresh);
        EXPECT_EQ(std::find(fresh.voxel.begin(), fresh.voxel.end(), thick.voxel[r]), fresh.voxel.end());
      }
    }
  }
}

TEST(Thinning, EveryVoxelStaysAtTheLeastThinnessAndTheBallsFillTheObject) {
  for (const Mask& mask : {lumps(), random_mask({20, 22, 18}, 0.9, 6)}) {
    const VolumetricSkeleton s = skeleton(mask, least_thinness);
    EXPECT_EQ(s.size(), static_cast<std::size_t>(std::count(mask.inside.begin(), mask.inside.end(), 1)));
    std::vector<std::uint8_t> filled(mask.inside.size(), 0);
    for (std::size_t r = 0; r < s.size(); ++r) {
      const auto square = static_cast<int>(s.distance[r]);
      const int reach = static_cast<int>(std::sqrt(square)) + 1;
      for (int z = -reach; z <= reach; ++z) {
        for (int y = -reach; y <= reach; ++y) {
          for (int x = -reach; x <= reach; ++x) {
            if (x * x + y * y + z * z >= square) continue;
            const int i = s.voxel[r][0] + x, j = s.voxel[r][1] + y, k = s.voxel[r][2] + z;
            ASSERT_TRUE(i >= 0 && j >= 0 && k >= 0 && i < mask.grid.size[0] && j < mask.grid.size[1] &&
                        k < mask.grid.size[2]);
            filled[mask.grid.offset(i, j, k)] = 1;
          }
        }
      }
    }
    EXPECT_EQ(filled, mask.inside);
  }
}

TEST(Thinning, TheSameForAnyNumberOfThreadsAndWhateverElseTheImageHolds) {
  const Mask mask = lumps();
  const VolumetricSkeleton all = skeleton(mask, 0.2);
  tbb::task_arena(1).execute([&] { expect_equal(skeleton(mask, 0.2), all); });
  // The same object in a larger image, three voxels in: the same deficits, so also across slabs.
  Mask larger;
  larger.grid.size = {50, 45, 80};
  larger = make_mask(larger.grid.size, [&](int i, int j, int k) {
    i -= 3, j -= 3, k -= 3;
    return i >= 0 && j >= 0 && k >= 0 && i < 43 && j < 37 && k < 70 && mask.inside[mask.grid.offset(i, j, k)];
  });
  const VolumetricSkeleton moved = skeleton(larger, 0.2);
  EXPECT_EQ(moved.deficit, all.deficit);
  EXPECT_EQ(moved.distance, all.distance);
}

TEST(Thinning, SegmentsStayWithTheirVoxels) {
  VolumetricSkeleton s = skeleton(lumps(), 0.1);
  for (std::size_t r = 0; r < s.size(); ++r) s.segment.push_back(static_cast<std::int32_t>(r));
  s.parent.assign(s.size(), VolumetricSkeleton::none);
  const VolumetricSkeleton t = thinner(s, 0.4);
  ASSERT_EQ(t.segment.size(), t.size());
  EXPECT_TRUE(t.parent.empty());
  for (std::size_t r = 0; r < t.size(); ++r)
    EXPECT_EQ(s.voxel[static_cast<std::size_t>(t.segment[r])], t.voxel[r]);
}

TEST(Thinning, RefusesWhatHasNoMeaning) {
  Mask mask = lumps();
  for (const double tp : {-2.1, 2.1, std::nan("")}) EXPECT_THROW(skeleton(mask, tp), Error);
  const VolumetricSkeleton s = skeleton(mask, 0.4);
  EXPECT_THROW(thinner(s, 0.3), Error);
  EXPECT_EQ(thinner(s, most_thinness).size(), 0U);
  mask.grid.spacing = {1, 1, 1.1};
  EXPECT_THROW(skeleton(mask, 0.4), Error);
}

}  // namespace
}  // namespace ecorche::thin
