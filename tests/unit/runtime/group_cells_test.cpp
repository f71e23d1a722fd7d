// SPDX-License-Identifier: Apache-2.0
// Groups that share palettes against a search of all groups for each, and what is moved by way of them
// against each vertex' own tet.
#include "runtime/skin/group_cells.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "runtime/skin/vertex_groups.hpp"

namespace ecorche::runtime {
namespace {

GroupNodes near_groups(std::size_t groups, std::uint32_t nodes, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::uint32_t> first(0, nodes - 1), count(1, 12);
  GroupNodes out;
  for (std::size_t g = 0; g < groups; ++g) {
    const std::uint32_t from = first(random), many = count(random);
    for (std::uint32_t n = from; n < std::min(nodes, from + many); ++n) out.node.push_back(n);
    out.begin.push_back(static_cast<std::uint32_t>(out.node.size()));
  }
  return out;
}

// As share_palettes says it, asking every group each time.
GroupCells asked_of_all(const GroupNodes& nodes, std::size_t most_nodes, std::size_t most_groups) {
  GroupCells out;
  std::set<std::uint32_t> free;
  for (std::uint32_t g = 0; g < nodes.groups(); ++g) free.insert(g);
  while (!free.empty()) {
    std::set<std::uint32_t> held;
    std::uint32_t next = *free.begin();
    for (std::size_t in_cell = 1;; ++in_cell) {
      free.erase(next);
      out.group.push_back(next);
      held.insert(nodes.of(next).begin(), nodes.of(next).end());
      std::size_t least = most_nodes + 1;
      for (const std::uint32_t g : free) {
        const auto of = nodes.of(g);
        const auto added = static_cast<std::size_t>(
            std::count_if(of.begin(), of.end(), [&](auto n) { return !held.contains(n); }));
        if (added == of.size() || added >= least) continue;  // it shares nothing, or is no nearer
        least = added;
        next = g;
      }
      if (in_cell == most_groups || held.size() + least > most_nodes) break;
    }
    out.end.push_back(static_cast<std::uint32_t>(out.group.size()));
  }
  return out;
}

TEST(GroupCells, TakeWhatAddsFewestNodes) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    const GroupNodes nodes = near_groups(60 + seed, 100, seed);
    for (const std::size_t most_groups : {1, 3, 8}) {
      const GroupCells found = share_palettes(nodes, 20, most_groups);
      const GroupCells expected = asked_of_all(nodes, 20, most_groups);
      EXPECT_EQ(found.group, expected.group) << seed;
      EXPECT_EQ(found.end, expected.end) << seed;
    }
  }
}

TEST(GroupCells, AGroupBeyondThePaletteStandsAlone) {
  GroupNodes nodes;
  for (std::uint32_t n = 0; n < 30; ++n) nodes.node.push_back(n);
  nodes.begin = {0, 30};
  nodes.node.push_back(4);
  nodes.begin.push_back(31);
  const GroupCells cells = share_palettes(nodes, 20, 8);
  EXPECT_EQ(cells.end, (std::vector<std::uint32_t>{1, 2}));
  EXPECT_TRUE(share_palettes({}, 20, 8).end.empty());
}

// Thousands of groups about one node: a bounded search, not all pairs of them.
TEST(GroupCells, ManyGroupsAboutOneNode) {
  GroupNodes nodes;
  for (std::uint32_t g = 0; g < 200'000; ++g) {
    nodes.node.insert(nodes.node.end(), {0, 1, 2, 3});
    nodes.begin.push_back(4 * (g + 1));
  }
  const GroupCells cells = share_palettes(nodes, 64, 8);
  EXPECT_EQ(cells.end.size(), 25'000u);
  std::vector<std::uint32_t> group = cells.group;
  EXPECT_TRUE(std::is_sorted(group.begin(), group.end()));
}

// A row of tets along x, `per_tet` vertices in each, in order or as a shuffle leaves them.
Model strip(std::size_t tets, std::size_t per_tet, bool shuffled) {
  Model model;
  const auto rows = static_cast<Eigen::Index>(tets);
  model.nodes.resize(rows + 3, 3);
  model.tets.resize(rows, 4);
  for (Eigen::Index n = 0; n < rows + 3; ++n) {
    model.nodes.row(n) << static_cast<float>(n), static_cast<float>(n % 2), static_cast<float>(n % 3);
  }
  std::vector<std::int32_t> tet;
  for (Eigen::Index t = 0; t < rows; ++t) {
    for (int c = 0; c < 4; ++c) model.tets(t, c) = static_cast<int>(t) + c;
    tet.insert(tet.end(), per_tet, static_cast<std::int32_t>(t));
  }
  std::mt19937 random(5);
  if (shuffled) std::shuffle(tet.begin(), tet.end(), random);
  Tissue tissue;
  tissue.tet = tet;
  const auto count = static_cast<Eigen::Index>(tet.size());
  tissue.V.resize(count, 3);
  tissue.barycentric.resize(count, 4);
  for (Eigen::Index v = 0; v < count; ++v) {
    tissue.barycentric.row(v) << 0.1F, 0.2F, 0.3F, 0.4F;
    tissue.V.row(v).setZero();
    for (int c = 0; c < 4; ++c) {
      tissue.V.row(v) +=
          tissue.barycentric(v, c) * model.nodes.row(model.tets(tet[static_cast<std::size_t>(v)], c));
    }
  }
  tissue.F.resize(count / 3, 3);
  for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) tissue.F(f, c) = static_cast<int>(3 * f + c);
  }
  model.tissues.push_back(tissue);
  return model;
}

std::vector<std::uint32_t> own_lanes(const Model& model) {
  std::vector<std::uint32_t> lane(model.node_count());
  for (std::size_t n = 0; n < lane.size(); ++n) lane[n] = static_cast<std::uint32_t>(n);
  return lane;
}

TEST(VertexGroups, HoldEachVertexOnceWithItsTetAndItsNumbers) {
  for (const bool shuffled : {false, true}) {
    const Model model = strip(400, 7, shuffled);
    const Tissue& tissue = model.tissues[0];
    const VertexGroups groups =
        group_vertices(model, tissue, NodesOfTissues(model).of(tissue), own_lanes(model));
    EXPECT_EQ(groups.in_order, !shuffled);
    EXPECT_LT(groups.cells.size(), groups.groups.size());
    std::vector<int> seen(groups.vertices);
    for (std::size_t c = 0; c < groups.cells.size(); ++c) {
      for (std::size_t g = groups.first_group(c); g < groups.cells[c].end; ++g) {
        const VertexGroups::Group& group = groups.groups[g];
        for (std::size_t i = 0; i < groups.group_vertices(group); ++i) {
          const std::size_t v = shuffled ? groups.vertex[group.first + i] : group.first + i;
          ++seen[v];
          for (unsigned k = 0; k < 4; ++k) {
            const std::uint32_t place = groups.corners[16 * g + i] >> 8 * k & 255U;
            ASSERT_LT(place, groups.cells[c].count);
            const std::uint32_t node = groups.rows[groups.cells[c].palette + place] / 3;
            // Corner k of the tet or, turned, another of 1 to 3: its number says which.
            const float b =
                k == 0 ? 0.1F
                       : group.low +
                             group.step * static_cast<float>(groups.narrow[group.data + 16 * (k - 1) + i]);
            const int corner = static_cast<int>(std::lround(10 * b)) - 1;
            EXPECT_NEAR(b, tissue.barycentric(static_cast<Eigen::Index>(v), corner), 1e-5);
            EXPECT_EQ(static_cast<int>(node), model.tets(tissue.tet[v], corner));
          }
        }
      }
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(seen.size()));
  }
}

// A vertex of no triangle has no normal, and says so.
TEST(VertexGroups, MarkVerticesWithoutANormal) {
  Model model = strip(40, 4, false);
  model.tissues[0].F.resize(0, 3);
  const VertexGroups groups =
      group_vertices(model, model.tissues[0], NodesOfTissues(model).of(model.tissues[0]), own_lanes(model));
  for (std::size_t g = 0; g < groups.groups.size(); ++g) {
    for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(groups.normal[32 * g + i], VertexGroups::no_normal);
  }
}

}  // namespace
}  // namespace ecorche::runtime
