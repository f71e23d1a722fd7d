// SPDX-License-Identifier: Apache-2.0
// Meshes cut along faces, held against the same by looking at all pairs of tets.
#include "preprocess/parting/split_nodes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <set>

namespace ecorche::parting {
namespace {

// Cubes of six tets each (Kuhn's), n a side.
TetMesh cubes(int n) {
  TetMesh mesh;
  const int side = n + 1;
  mesh.V.resize(side * side * side, 3);
  const auto node = [&](int i, int j, int k) { return i + side * (j + side * k); };
  for (int k = 0; k < side; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) mesh.V.row(node(i, j, k)) << i, j, k;
  std::vector<std::array<int, 4>> tets;
  std::array<int, 3> axes{0, 1, 2};
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        std::sort(axes.begin(), axes.end());
        do {
          std::array<int, 3> at{i, j, k};
          std::array<int, 4> tet{node(i, j, k), 0, 0, 0};
          for (std::size_t s = 0; s < 3; ++s) {
            ++at[static_cast<std::size_t>(axes[s])];
            tet[s + 1] = node(at[0], at[1], at[2]);
          }
          tets.push_back(tet);
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
    }
  }
  mesh.T.resize(static_cast<Eigen::Index>(tets.size()), 4);
  for (std::size_t t = 0; t < tets.size(); ++t) {
    auto row = mesh.T.row(static_cast<Eigen::Index>(t));
    row << tets[t][0], tets[t][1], tets[t][2], tets[t][3];
    if (tet_det(mesh.V.row(row[0]), mesh.V.row(row[1]), mesh.V.row(row[2]), mesh.V.row(row[3])) < 0)
      std::swap(row[2], row[3]);
  }
  mesh.label.assign(tets.size(), TetMesh::soft);
  return mesh;
}

std::set<std::int32_t> corners(const Tets& T, std::int32_t t) {
  return {T(t, 0), T(t, 1), T(t, 2), T(t, 3)};
}

std::set<std::int32_t> corners(const Tets& T, const Face& face) {
  return {node_of(T, face, 0), node_of(T, face, 1), node_of(T, face, 2)};
}

TEST(FaceNeighbours, are_the_tets_with_three_nodes_alike) {
  const TetMesh mesh = cubes(2);
  const FaceNeighbours across(mesh.T, mesh.V.rows());
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh.T.rows()); ++t) {
    for (int c = 0; c < 4; ++c) {
      const std::set<std::int32_t> face = corners(mesh.T, Face{t, c});
      std::int32_t behind = -1;
      for (std::int32_t s = 0; s < static_cast<std::int32_t>(mesh.T.rows()); ++s) {
        const std::set<std::int32_t> other = corners(mesh.T, s);
        if (s != t && std::includes(other.begin(), other.end(), face.begin(), face.end())) behind = s;
      }
      ASSERT_EQ(across.behind({t, c}), behind);
      if (behind < 0) continue;
      const Face back = across.other({t, c});
      EXPECT_EQ(back.tet, behind);
      EXPECT_EQ(corners(mesh.T, back), face);
      EXPECT_EQ(across.behind(back), t);
    }
  }
}

TEST(FaceNeighbours, faces_turn_outwards) {
  const TetMesh mesh = cubes(1);
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh.T.rows()); ++t) {
    for (int c = 0; c < 4; ++c) {
      const auto at = [&](int n) { return mesh.V.row(node_of(mesh.T, {t, c}, n)); };
      EXPECT_LT(tet_det(at(0), at(1), at(2), mesh.V.row(mesh.T(t, c))), 0);
    }
  }
}

// Corners of tets are one node where a chain of tets about it leads from one to the other through faces that
// are not cut: so by trying all pairs until nothing joins any more.
std::size_t slow_nodes(const TetMesh& mesh, const std::set<std::set<std::int32_t>>& cut) {
  const auto tets = static_cast<std::int32_t>(mesh.T.rows());
  std::size_t count = 0;
  for (std::int32_t n = 0; n < static_cast<std::int32_t>(mesh.V.rows()); ++n) {
    std::vector<std::int32_t> about;
    for (std::int32_t t = 0; t < tets; ++t) {
      if (corners(mesh.T, t).count(n) != 0) about.push_back(t);
    }
    std::vector<int> set(about.size());
    std::iota(set.begin(), set.end(), 0);
    for (bool joined = true; joined;) {
      joined = false;
      for (std::size_t a = 0; a < about.size(); ++a) {
        for (std::size_t b = 0; b < about.size(); ++b) {
          const std::set<std::int32_t> p = corners(mesh.T, about[a]), q = corners(mesh.T, about[b]);
          std::set<std::int32_t> face;
          std::set_intersection(p.begin(), p.end(), q.begin(), q.end(), std::inserter(face, face.end()));
          if (face.size() != 3 || cut.count(face) != 0 || set[a] <= set[b]) continue;
          set[a] = set[b];
          joined = true;
        }
      }
    }
    count += std::set<int>(set.begin(), set.end()).size();
  }
  return count;
}

TEST(SplitNodes, a_cut_through_and_through_makes_two_meshes) {
  TetMesh mesh = cubes(2);
  const TetMesh before = mesh;
  const FaceNeighbours across(mesh.T, mesh.V.rows());
  const auto left = [&](std::int32_t t) {
    return (before.V(before.T(t, 0), 0) + before.V(before.T(t, 1), 0) + before.V(before.T(t, 2), 0) +
            before.V(before.T(t, 3), 0)) < 4;
  };
  std::vector<Face> cut;
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh.T.rows()); ++t) {
    for (int c = 0; c < 4; ++c) {
      const std::int32_t next = across.behind({t, c});
      if (next >= 0 && left(t) && !left(next)) cut.push_back({t, c});
    }
  }
  EXPECT_EQ(cut.size(), 8U);
  split_nodes(mesh, across, cut);
  EXPECT_EQ(mesh.V.rows(), 36);  // nine nodes lay on the cut
  EXPECT_EQ(mesh.label, before.label);
  std::set<std::int32_t> nodes_left, nodes_right;
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh.T.rows()); ++t) {
    for (int c = 0; c < 4; ++c) {
      (left(t) ? nodes_left : nodes_right).insert(mesh.T(t, c));
      EXPECT_EQ(mesh.V.row(mesh.T(t, c)), before.V.row(before.T(t, c)));
    }
  }
  EXPECT_EQ(nodes_left.size(), 18U);
  EXPECT_EQ(nodes_right.size(), 18U);
}

TEST(SplitNodes, cuts_that_end_within_part_only_what_they_part) {
  std::mt19937 random(3);
  for (int round = 0; round < 60; ++round) {
    TetMesh mesh = cubes(2);
    const FaceNeighbours across(mesh.T, mesh.V.rows());
    std::vector<Face> cut;
    std::set<std::set<std::int32_t>> named;
    const auto tets = static_cast<std::uint32_t>(mesh.T.rows());
    const std::uint32_t faces = 1 + random() % 80;
    for (std::uint32_t f = 0; f < faces; ++f) {
      const Face face{static_cast<std::int32_t>(random() % tets), static_cast<int>(random() % 4)};
      if (across.behind(face) < 0 || !named.insert(corners(mesh.T, face)).second) continue;
      cut.push_back(face);
    }
    const std::size_t expected = slow_nodes(mesh, named);
    split_nodes(mesh, across, cut);
    ASSERT_EQ(static_cast<std::size_t>(mesh.V.rows()), expected) << round;
  }
}

TEST(LoosePieces, go_to_the_part_that_they_have_most_in_common_with) {
  const TetMesh bare = cubes(3);
  const FaceNeighbours across(bare.T, bare.V.rows());
  const auto cube_of = [&](std::int32_t t) {
    const Eigen::RowVector3d middle = (bare.V.row(bare.T(t, 0)) + bare.V.row(bare.T(t, 1)) +
                                       bare.V.row(bare.T(t, 2)) + bare.V.row(bare.T(t, 3))) /
                                      4;
    return std::array<int, 3>{static_cast<int>(middle[0]), static_cast<int>(middle[1]),
                              static_cast<int>(middle[2])};
  };
  // Part 7 is a layer with bone, and one cube far from it; all else is -1, with bone.
  TetMesh mesh = bare;
  std::vector<std::int16_t> part(mesh.label.size(), -1), expected = part;
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh.T.rows()); ++t) {
    const auto at = cube_of(t);
    const bool layer = at[2] == 0, lone = at == std::array<int, 3>{2, 2, 2};
    part[static_cast<std::size_t>(t)] = static_cast<std::int16_t>(layer || lone ? 7 : -1);
    expected[static_cast<std::size_t>(t)] = static_cast<std::int16_t>(layer ? 7 : -1);
    if (at == std::array<int, 3>{1, 1, 0}) mesh.label[static_cast<std::size_t>(t)] = 1;
    if (at == std::array<int, 3>{0, 0, 2}) mesh.label[static_cast<std::size_t>(t)] = 2;
  }
  const auto cut = [&] {
    std::vector<Face> out;
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh.T.rows()); ++t) {
      for (int c = 0; c < 4; ++c) {
        const std::int32_t next = across.behind({t, c});
        if (next > t && part[static_cast<std::size_t>(t)] != part[static_cast<std::size_t>(next)])
          out.push_back({t, c});
      }
    }
    return out;
  };
  EXPECT_TRUE(give_loose_pieces(mesh, across, cut(), part));
  EXPECT_EQ(part, expected);
  EXPECT_FALSE(give_loose_pieces(mesh, across, cut(), part));
}

}  // namespace
}  // namespace ecorche::parting
