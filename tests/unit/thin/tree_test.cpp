// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/tree.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <set>
#include <tuple>

#include "preprocess/thin/thinning.hpp"
#include "tests/unit/thin/brute_force.hpp"

namespace ecorche::thin {
namespace {

using Pair = std::pair<std::int32_t, std::int32_t>;

std::set<Pair> edges_of(const std::vector<std::int32_t>& parent) {
  std::set<Pair> edges;
  for (std::size_t r = 0; r < parent.size(); ++r) {
    const auto row = static_cast<std::int32_t>(r);
    if (parent[r] >= 0) edges.insert({std::min(row, parent[r]), std::max(row, parent[r])});
  }
  return edges;
}

// Prim over all pairs at most `reach` apart, from each component's first row; ties as spanning_tree breaks
// them.
std::set<Pair> prim(const VolumetricSkeleton& s, double alpha, double reach) {
  using Key = std::tuple<double, std::int32_t, std::int32_t>;
  const Key nothing{std::numeric_limits<double>::infinity(), 0, 0};
  std::vector<Key> best(s.size(), nothing);
  std::vector<std::uint8_t> in(s.size(), 0);
  std::set<Pair> edges;
  for (std::size_t round = 0; round < s.size(); ++round) {
    std::size_t next = s.size();
    for (std::size_t r = 0; r < s.size(); ++r) {
      if (in[r] == 0 && (next == s.size() || best[r] < best[next])) next = r;
    }
    in[next] = 1;
    if (best[next] < nothing) edges.insert({std::get<1>(best[next]), std::get<2>(best[next])});
    for (std::size_t r = 0; r < s.size(); ++r) {
      if (in[r] != 0) continue;
      double square = 0;
      for (std::size_t a = 0; a < 3; ++a)
        square += std::pow(static_cast<double>(s.voxel[r][a]) - static_cast<double>(s.voxel[next][a]), 2);
      if (square > reach * reach) continue;
      const std::size_t low = std::min(r, next), high = std::max(r, next);
      best[r] = std::min(best[r], Key{edge_weight(s, low, high, alpha), static_cast<std::int32_t>(low),
                                      static_cast<std::int32_t>(high)});
    }
  }
  return edges;
}

VolumetricSkeleton skeleton_of(const Mask& mask, double tp,
                               DistanceMetric metric = DistanceMetric::euclidean) {
  return thin(distance_map(mask, metric, {}), mask.grid, tp, {});
}

TEST(Tree, IsPrimsOverTheNeighbourhood) {
  const Mask masks[] = {ellipsoid({24, 20, 30}, {10, 8, 13}), random_mask({16, 14, 12}, 0.9, 3),
                        random_mask({12, 12, 12}, 0.4, 5)};
  for (const Mask& mask : masks) {
    for (const DistanceMetric metric : {DistanceMetric::euclidean, DistanceMetric::chamfer345}) {
      const VolumetricSkeleton s = skeleton_of(mask, 0.35, metric);
      ASSERT_GT(s.size(), 20U);
      for (const auto& [alpha, reach] : {std::pair{0.7, 1}, {0.825, 3}, {0.95, 40}}) {
        const auto parent = spanning_tree(s, {alpha, reach, false}, {});
        const auto slow = prim(s, alpha, reach);
        EXPECT_EQ(edges_of(parent), slow);
        EXPECT_EQ(component_count(parent), s.size() - slow.size());
      }
    }
  }
}

TEST(Tree, WeightIsTheFormula) {
  VolumetricSkeleton s;
  s.grid.size = {20, 20, 20};
  s.voxel = {{1, 2, 3}, {4, 6, 3}};
  s.distance = {4, 25};
  EXPECT_DOUBLE_EQ(edge_weight(s, 0, 1, 0.8), 0.8 * 5 + 0.2 * 3);
  s.metric = DistanceMetric::chamfer345;
  EXPECT_DOUBLE_EQ(edge_weight(s, 0, 1, 0.8), 0.8 * 5 + 0.2 * 7);
}

Mask two_balls() {
  return make_mask({60, 16, 16}, [](int i, int j, int k) {
    const int y = (j - 8) * (j - 8) + (k - 8) * (k - 8);
    return (i - 10) * (i - 10) + y < 40 || (i - 45) * (i - 45) + y < 25;
  });
}

TEST(Tree, ComponentsAreReportedOrConnected) {
  const VolumetricSkeleton s = skeleton_of(two_balls(), 0.5);
  const auto apart = spanning_tree(s, {}, {});
  EXPECT_GE(component_count(apart), 2U);
  const auto joined = spanning_tree(s, {0.825, 3, true}, {});
  EXPECT_EQ(component_count(joined), 1U);
  const auto before = edges_of(apart), after = edges_of(joined);
  EXPECT_TRUE(std::includes(after.begin(), after.end(), before.begin(), before.end()));
  EXPECT_EQ(after.size(), s.size() - 1);
}

TEST(Tree, RootsAreTheDeepestAndParentsComeFirst) {
  const VolumetricSkeleton s = skeleton_of(two_balls(), 0.3);
  const auto parent = spanning_tree(s, {}, {});
  const auto order = parents_first(parent);
  ASSERT_EQ(order.size(), s.size());
  std::vector<std::int32_t> top(s.size(), -1);
  for (const std::int32_t row : order) {
    const auto r = static_cast<std::size_t>(row);
    if (parent[r] < 0) {
      top[r] = row;
    } else {
      ASSERT_GE(top[static_cast<std::size_t>(parent[r])], 0);  // seen before
      top[r] = top[static_cast<std::size_t>(parent[r])];
    }
    EXPECT_LE(s.distance[r], s.distance[static_cast<std::size_t>(top[r])]);
  }
}

TEST(Tree, TheSameForAnyNumberOfThreads) {
  const VolumetricSkeleton s = skeleton_of(random_mask({40, 30, 35}, 0.93, 7), 0.2);
  const auto parent = spanning_tree(s, {0.8, 2, true}, {});
  tbb::task_arena(1).execute([&] { EXPECT_EQ(spanning_tree(s, {0.8, 2, true}, {}), parent); });
}

TEST(Tree, NothingAndOptionsOutOfRange) {
  VolumetricSkeleton s;
  s.grid.size = {4, 4, 4};
  EXPECT_TRUE(spanning_tree(s, {0.8, 3, true}, {}).empty());
  s.voxel = {{1, 1, 1}};
  s.distance = {1};
  EXPECT_EQ(spanning_tree(s, {0.8, 3, true}, {}), std::vector<std::int32_t>{-1});
  for (const TreeOptions& o :
       {TreeOptions{0.6, 3, false}, {0.96, 3, false}, {0.8, 0, false}, {0.8, 65, false}})
    EXPECT_THROW(spanning_tree(s, o, {}), Error);
}

}  // namespace
}  // namespace ecorche::thin
