// SPDX-License-Identifier: Apache-2.0
// What a probe is made of: orders of points and tets, palettes of tets, columns of tissues.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/tet_runs.hpp>
#include "runtime/probe/halving_order.hpp"
#include "runtime/probe/space_order.hpp"
#include "runtime/probe/tissue_cells.hpp"
#include "runtime/probe/tissue_columns.hpp"
#include "runtime/volume/tet_palettes.hpp"
#include "tests/support/instruction_sets.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

// The same halves by sorting them.
void halve_slowly(const std::vector<std::array<float, 3>>& middles, std::vector<std::uint32_t>& tets,
                  std::size_t begin, std::size_t end, std::size_t width) {
  if (end - begin <= width) return;
  std::size_t stretch = width;
  while (stretch * width < end - begin) stretch *= width;
  std::array<float, 3> low{1e30F, 1e30F, 1e30F}, high{-1e30F, -1e30F, -1e30F}, side{};
  for (std::size_t i = begin; i < end; ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], middles[tets[i]][a]);
      high[a] = std::max(high[a], middles[tets[i]][a]);
      side[a] = high[a] - low[a];
    }
  }
  const auto axis = static_cast<std::size_t>(std::max_element(side.begin(), side.end()) - side.begin());
  std::sort(tets.begin() + static_cast<std::ptrdiff_t>(begin),
            tets.begin() + static_cast<std::ptrdiff_t>(end),
            [&](auto a, auto b) { return std::pair(middles[a][axis], a) < std::pair(middles[b][axis], b); });
  const std::size_t middle = begin + (end - begin + stretch - 1) / stretch / 2 * stretch;
  halve_slowly(middles, tets, begin, middle, width);
  halve_slowly(middles, tets, middle, end, width);
}

TEST(HalvingOrder, EveryRunHoldsWhatSortingPutsThere) {
  std::mt19937 random(2);
  for (const Eigen::Index count : {0, 1, 16, 17, 300, 4096, 50001}) {
    PointsF nodes(std::max<Eigen::Index>(4, count), 3);
    // In whole numbers: many middles are equal.
    for (Eigen::Index i = 0; i < nodes.size(); ++i)
      nodes.data()[i] = static_cast<float>(random() % 8 * (1 + i % 3));
    Tets tets(count, 4);
    for (Eigen::Index i = 0; i < tets.size(); ++i)
      tets.data()[i] = static_cast<std::int32_t>(random() % static_cast<unsigned>(nodes.rows()));
    std::vector<std::array<float, 3>> middles;
    std::vector<std::uint32_t> slow;
    for (Eigen::Index t = 0; t < count; ++t) {
      Eigen::RowVector3f middle = Eigen::RowVector3f::Zero();
      for (int c = 0; c < 4; ++c) middle += nodes.row(tets(t, c)) / 4;
      middles.push_back({middle[0], middle[1], middle[2]});
      slow.push_back(static_cast<std::uint32_t>(t));
    }
    halve_slowly(middles, slow, 0, slow.size(), 16);
    std::vector<std::uint32_t> fast = halving_order(tets, nodes, 16);
    ASSERT_EQ(fast.size(), slow.size());
    for (std::size_t first = 0; first < slow.size(); first += 16) {
      for (auto* order : {&fast, &slow}) {
        const auto begin = order->begin() + static_cast<std::ptrdiff_t>(first);
        std::sort(begin, begin + static_cast<std::ptrdiff_t>(std::min<std::size_t>(16, slow.size() - first)));
      }
    }
    EXPECT_EQ(fast, slow) << count;
  }
}

TEST(SpaceOrder, MortonsPlaceInterleavesBits) {
  EXPECT_EQ(morton_place({1, 0, 0}), 1U);
  EXPECT_EQ(morton_place({0, 1, 0}), 2U);
  EXPECT_EQ(morton_place({0, 0, 1}), 4U);
  EXPECT_EQ(morton_place({1023, 1023, 1023}), (1U << 30U) - 1);
  EXPECT_EQ(morton_place({512, 0, 0}), 1U << 27U);
}

TEST(SpaceOrder, CellsEndAtTheBox) {
  const SpaceOrder order({0, 0, 0}, {1023, 10, 10});
  const auto cell = [&](float x, float y, float z) {
    const std::array<float, 3> point{x, y, z};
    return order.cell(point.data());
  };
  EXPECT_EQ(cell(5.5F, 9.5F, 1), (SpaceCell{5, 9, 1})) << "by the longest side";
  EXPECT_EQ(cell(-7, 1e30F, std::numeric_limits<float>::infinity()), (SpaceCell{0, 1023, 1023}));
  EXPECT_EQ(cell(std::nanf(""), 0, 0), (SpaceCell{0, 0, 0}));
}

TEST(SpaceOrder, SortsAsAStableSort) {
  std::mt19937 random(3);
  std::vector<std::uint32_t> places;
  std::vector<std::uint32_t> fast, other;
  for (const unsigned bits : {30U, 21U, 9U, 32U}) {
    places.clear();
    for (int i = 0; i < 5000; ++i)
      places.push_back(random() % 7 == 0 ? random() % 5 : random() % (std::uint64_t{1} << bits));
    std::vector<std::uint32_t> slow(places.size());
    for (std::size_t i = 0; i < slow.size(); ++i) slow[i] = static_cast<std::uint32_t>(i);
    std::stable_sort(slow.begin(), slow.end(), [&](auto a, auto b) { return places[a] < places[b]; });
    SpaceOrder::sort(places, fast, other);
    EXPECT_EQ(fast, slow);
  }
}

TEST(TetRuns, StepsAreTheNearestToTheNodes) {
  const Model model = test::toy_model();
  std::vector<float> nodes(model.nodes.data(), model.nodes.data() + model.nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i] += 3 * std::sin(0.1F * static_cast<float>(i));
  const TetRuns runs(model.tets, model.nodes);
  test::for_instruction_sets([&] {
    PaddedNodes padded;
    BoxTree boxes;
    follow(runs, nodes, padded, boxes);
    fit_blocks({runs, padded, boxes});
    std::size_t packed = 0;
    for (std::size_t x = 0; x < 192 * runs.runs(); ++x) {
      const std::size_t r = x / 192, i = x / 12 % 16, c = x / 3 % 4, a = x % 3;
      const ByteBoxes& in = boxes.lowest[r / 16];
      const auto node = static_cast<std::size_t>(model.tets(runs.tets(r)[i], static_cast<Eigen::Index>(c)));
      const float place = padded[runs.row(r, i, c) + a];
      ASSERT_EQ(place, nodes[3 * node + a]);
      const double steps = static_cast<double>((place - in.from[a]) * in.scale);
      EXPECT_LE(in.low[a][r % 16], steps);
      EXPECT_LT(steps, in.high[a][r % 16] + 1);
      if (!runs.packed(r)) continue;
      ++packed;
      EXPECT_NEAR(boxes.runs[r].node[3 * std::size_t{runs.corners(r)[16 * c + i]} + a],
                  (steps - in.low[a][r % 16]) * static_cast<double>(boxes.runs[r].finer), 0.501);
    }
    EXPECT_GT(packed, 1000U);
  });
}

TEST(TetPalettes, BytesFindTheCornersOfEveryTet) {
  std::mt19937 random(4);
  Tets tets(37, 4);
  for (Eigen::Index i = 0; i < tets.size(); ++i) tets.data()[i] = static_cast<std::int32_t>(random() % 80);
  std::vector<std::uint32_t> order(37);
  for (std::size_t i = 0; i < 37; ++i) order[i] = static_cast<std::uint32_t>(36 - i);
  for (const std::vector<std::uint32_t>& ordered : {order, std::vector<std::uint32_t>{}}) {
    const TetPalettes palettes(tets, ordered, 3);
    ASSERT_EQ(palettes.runs(), 3U);
    for (std::size_t place = 0; place < 48; ++place) {
      const std::size_t run = place / 16, of = std::min<std::size_t>(place, 36);
      const auto t = static_cast<Eigen::Index>(ordered.empty() ? of : 36 - of);
      for (Eigen::Index c = 0; c < 4; ++c) {
        const std::uint8_t byte = palettes.corners(run)[16 * static_cast<std::size_t>(c) + place % 16];
        EXPECT_EQ(palettes.rows(run)[byte], 3 * static_cast<std::uint32_t>(tets(t, c)));
      }
    }
    for (std::size_t run = 0; run < 3; ++run) {
      const auto rows = palettes.rows_of(run);
      EXPECT_EQ(std::adjacent_find(rows.begin(), rows.end(), std::greater_equal<>()), rows.end());
      EXPECT_EQ(palettes.filled(run), (rows.size() + 7) / 8 * 8);
      for (std::size_t i = rows.size(); i < palettes.filled(run); ++i)
        EXPECT_EQ(palettes.rows(run)[i], rows.back());
    }
  }
  EXPECT_EQ(TetPalettes(Tets(0, 4), {}, 3).runs(), 0U);
}

TEST(TissueColumns, ColumnsThroughVerticesAndEdgesCrossOnce) {
  // A cube about the origin, corners on whole numbers, asked along every vertex, edge and diagonal.
  Model cube;
  cube.tissues.resize(1);
  Tissue& box = cube.tissues[0];
  box.V.resize(8, 3);
  for (int v = 0; v < 8; ++v)
    box.V.row(v) << (v & 1 ? 2.0F : -2.0F), (v & 2 ? 2.0F : -2.0F), (v & 4 ? 2.0F : -2.0F);
  box.F.resize(12, 3);
  box.F << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7,
      1, 7, 5;
  ASSERT_TRUE(is_closed(box.F));
  const TissueColumns columns(cube);
  for (int i = -3; i <= 3; ++i) {
    for (int j = -3; j <= 3; ++j) {
      for (int k = -3; k <= 3; ++k) {
        const int far = std::max({std::abs(i), std::abs(j), std::abs(k)});
        const std::int32_t row =
            columns.at({static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)});
        if (far == 2) continue;  // on the surface: either side
        EXPECT_EQ(row, far < 2 ? 0 : TissueColumns::none) << i << j << k;
      }
    }
  }
}

TEST(TissueCells, SayWhatTheColumnsSay) {
  const Model model = test::toy_model();
  const TissueColumns columns(model);
  const TissueCells cells(columns);
  std::mt19937 random(6);
  std::vector<std::array<float, 3>> points{
      {std::nanf(""), 0, 0}, {INFINITY, 0, 100}, {0, -INFINITY, 100}, {0, 3e38F, -3e38F}};
  for (const Tissue& tissue : model.tissues) {
    const Eigen::RowVector3f low = tissue.V.colwise().minCoeff(), high = tissue.V.colwise().maxCoeff();
    for (Eigen::Index v = 0; v < tissue.V.rows(); ++v)
      points.push_back({tissue.V(v, 0), tissue.V(v, 1), tissue.V(v, 2)});
    for (int i = 0; i < 3000; ++i) {
      std::array<float, 3> point{};
      for (int a = 0; a < 3; ++a)
        point[static_cast<std::size_t>(a)] = std::uniform_real_distribution(low[a] - 5, high[a] + 5)(random);
      points.push_back(point);
    }
  }
  std::set<std::int32_t> found;
  for (const std::array<float, 3>& point : points) {
    const std::int32_t row = columns.at(point);
    EXPECT_EQ(cells.at(point), row) << point[0] << ' ' << point[1] << ' ' << point[2];
    found.insert(row);
  }
  EXPECT_GT(found.size(), 2U);
}

}  // namespace
}  // namespace ecorche::runtime
