// SPDX-License-Identifier: Apache-2.0
// What a probe is made of: orders of points, palettes of tets, columns of tissues.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "runtime/probe/space_order.hpp"
#include "runtime/probe/tissue_columns.hpp"
#include "runtime/quality/pose_quality.hpp"
#include "runtime/volume/tet_palettes.hpp"

namespace ecorche::runtime {
namespace {

TEST(SpaceOrder, NeighboursOnHilbertsCurveShareAFace) {
  // Every aligned cube of 16^3 cells is one piece of the curve.
  for (const SpaceCell& corner :
       {SpaceCell{0, 0, 0}, SpaceCell{1008, 1008, 1008}, SpaceCell{496, 512, 160}}) {
    std::vector<SpaceCell> along(4096);
    std::vector<std::uint32_t> places;
    for (std::uint32_t c = 0; c < 4096; ++c) {
      places.push_back(hilbert_place({corner[0] + c % 16, corner[1] + c / 16 % 16, corner[2] + c / 256}));
    }
    const std::uint32_t first = *std::min_element(places.begin(), places.end());
    for (std::uint32_t c = 0; c < 4096; ++c) {
      ASSERT_LT(places[c] - first, 4096U);
      along[places[c] - first] = {c % 16, c / 16 % 16, c / 256};
    }
    for (std::size_t i = 1; i < along.size(); ++i) {
      int apart = 0;
      for (std::size_t a = 0; a < 3; ++a)
        apart += std::abs(static_cast<int>(along[i][a]) - static_cast<int>(along[i - 1][a]));
      ASSERT_EQ(apart, 1) << i;
    }
  }
  EXPECT_EQ(hilbert_place({0, 0, 0}), 0U);
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
  for (int i = 0; i < 5000; ++i) places.push_back(random() % 7 == 0 ? random() % 5 : random() % (1U << 30U));
  std::vector<std::uint32_t> slow(places.size());
  for (std::size_t i = 0; i < slow.size(); ++i) slow[i] = static_cast<std::uint32_t>(i);
  std::stable_sort(slow.begin(), slow.end(), [&](auto a, auto b) { return places[a] < places[b]; });
  EXPECT_EQ(SpaceOrder::sorted(places), slow);
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

}  // namespace
}  // namespace ecorche::runtime
