// SPDX-License-Identifier: Apache-2.0
// Minimum cuts against all cuts there are.
#include "preprocess/parting/minimum_cut.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace ecorche::parting {
namespace {

TEST(CutGraph, a_chain_is_parted_at_its_weakest_tie) {
  CutGraph graph(5);
  const std::array<double, 4> ties{3, 2, 0.5, 4};
  for (std::int32_t v = 0; v < 4; ++v) graph.tie(v, v + 1, ties[static_cast<std::size_t>(v)]);
  graph.hold_inside(0, 10);
  graph.hold_outside(4, 10);
  EXPECT_EQ(graph.inside(), (std::vector<std::uint8_t>{1, 1, 1, 0, 0}));
}

TEST(CutGraph, what_leans_to_neither_side_is_outside) {
  CutGraph graph(3);
  graph.hold_inside(0, 1);
  EXPECT_EQ(graph.inside(), (std::vector<std::uint8_t>{1, 0, 0}));
  EXPECT_TRUE(CutGraph(0).inside().empty());
}

// Costs are whole 1024ths, so that none is rounded.
TEST(CutGraph, costs_no_more_than_any_other_cut) {
  std::mt19937 random(5);
  for (int round = 0; round < 300; ++round) {
    const auto count = static_cast<std::int32_t>(2 + random() % 8);
    const auto cost = [&] { return static_cast<double>(random() % 2048) / 1024; };
    struct Tie {
      std::int32_t a, b;
      double cost;
    };
    std::vector<Tie> ties;
    std::vector<double> inner(static_cast<std::size_t>(count), 0), outer = inner;
    CutGraph graph(count);
    for (std::int32_t a = 0; a < count; ++a) {
      const auto at = static_cast<std::size_t>(a);
      for (std::int32_t b = 0; b < a; ++b) {
        if (random() % 2 != 0) continue;
        ties.push_back({a, b, cost()});
        graph.tie(a, b, ties.back().cost);
      }
      if (random() % 3 == 0) graph.hold_inside(a, inner[at] = cost());
      if (random() % 3 == 0) graph.hold_outside(a, outer[at] = cost());
    }
    const auto price = [&](const auto& is_inside) {
      double sum = 0;
      for (const Tie& tie : ties) sum += is_inside(tie.a) != is_inside(tie.b) ? tie.cost : 0;
      for (std::int32_t v = 0; v < count; ++v)
        sum += is_inside(v) ? outer[static_cast<std::size_t>(v)] : inner[static_cast<std::size_t>(v)];
      return sum;
    };
    const std::vector<std::uint8_t> found = graph.inside();
    const double reached = price([&](std::int32_t v) { return found[static_cast<std::size_t>(v)] != 0; });
    for (std::uint32_t cut = 0; cut < (1U << count); ++cut)
      ASSERT_LE(reached, price([&](std::int32_t v) { return (cut >> v & 1U) != 0; }) + 1e-12) << round;
  }
}

}  // namespace
}  // namespace ecorche::parting
