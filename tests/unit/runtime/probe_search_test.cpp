// SPDX-License-Identifier: Apache-2.0
// Which tet holds a point, against a search of all.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include "tests/support/instruction_sets.hpp"
#include "tests/unit/runtime/probe_stage.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

TEST_F(ProbeTest, FindsTheTetsOfAnExhaustiveSearchOnEveryInstructionSet) {
  test::for_instruction_sets([&] {
    for (const double flexion : {0.0, 1.2, 2.7}) {
      SCOPED_TRACE(flexion);
      bend(flexion);
      if (flexion > 2) fold(flexion);
      const std::vector<float> points = random_points(nodes, 1500);
      probe.posed_to_rest(tree, points, {}, out);
      expect_exhaustive(nodes, points, flexion > 2);
    }
    const std::vector<float> rest = rest_nodes(*model), points = random_points(rest, 1500);
    probe.rest_to_posed(tree, points, {}, out);
    expect_exhaustive(rest, points);
  });
}

TEST_F(ProbeTest, FindsThemWhereEveryPointLiesInThousandsOfBoxes) {
  // At random: runs as wide as the mesh, on up to 64 nodes; a tree too wide to be looked at from its leaves.
  Model heap;
  heap.nodes.resize(600, 3);
  for (Eigen::Index i = 0; i < heap.nodes.size(); ++i)
    heap.nodes.data()[i] = std::uniform_real_distribution(0.0F, 100.0F)(random);
  heap.tets.resize(17003, 4);
  for (Eigen::Index i = 0; i < heap.tets.size(); ++i)
    heap.tets.data()[i] = std::uniform_int_distribution(0, 599)(random);
  heap.tet_label.assign(17003, 1);
  const Probe of(std::make_shared<const Model>(heap));
  const std::vector<float> rest = rest_nodes(heap);
  of.follow(rest, tree);
  std::vector<float> points;
  for (int i = 0; i < 3 * 70; ++i) {
    const float beyond = i < 3 * 50 ? -5.0F : 20.0F;  // the first fifty lie in nearly every box
    points.push_back(std::uniform_real_distribution(-beyond, 100 + beyond)(random));
  }
  std::vector<std::int32_t> slow;
  std::size_t twice = 0, outside = 0;
  for (std::size_t i = 0; i < points.size() / 3; ++i) {
    slow.push_back(exhaustive(heap.tets, rest, at(points, i), twice));
    outside += slow.back() == -1;
  }
  EXPECT_GT(twice, 1000U);
  EXPECT_GT(outside, 5U);
  test::for_instruction_sets([&] {
    of.posed_to_rest(tree, points, {}, out);
    for (std::size_t i = 0; i < slow.size(); ++i) EXPECT_TRUE(slow[i] == -2 || out.tet[i] == slow[i]) << i;
  });
}

TEST_F(ProbeTest, NodesAndFacesAreHeldByTheLowestTet) {
  nodes = rest_nodes(*model);
  probe.follow(nodes, tree);
  std::vector<float> points = nodes;
  std::vector<std::int32_t> lowest(nodes.size() / 3, std::numeric_limits<std::int32_t>::max());
  for (std::int32_t t = 0; t < model->tets.rows(); ++t) {
    for (int c = 0; c < 4; ++c) {
      std::int32_t& low = lowest[static_cast<std::size_t>(model->tets(t, c))];
      low = std::min(low, t);
    }
  }
  probe.posed_to_rest(tree, points, {}, out);
  EXPECT_EQ(out.tet, lowest);
}

TEST_F(ProbeTest, NoPointBetweenTwoTetsIsLost) {
  // Middles of inner faces: on either side of them by less than float32 tells.
  bend(0.8);
  std::map<std::array<std::int32_t, 3>, int> faces;
  for (std::int32_t t = 0; t < model->tets.rows(); ++t) {
    for (int without = 0; without < 4; ++without) {
      std::array<std::int32_t, 3> face;
      for (int c = 0; c < 3; ++c) face[static_cast<std::size_t>(c)] = model->tets(t, (without + 1 + c) % 4);
      std::sort(face.begin(), face.end());
      ++faces[face];
    }
  }
  std::vector<float> points;
  for (const auto& [face, tets] : faces) {
    if (tets != 2) continue;
    Vector3d middle = Vector3d::Zero();
    for (const std::int32_t n : face) middle += at(nodes, static_cast<std::size_t>(n)) / 3;
    for (const double x : middle) points.push_back(static_cast<float>(x));
  }
  ASSERT_GT(points.size(), 900U);
  probe.posed_to_rest(tree, points, {}, out);
  EXPECT_EQ(std::count(out.tet.begin(), out.tet.end(), TetPlace::none), 0);
}

TEST_F(ProbeTest, WhereTetsFoldTheLowestPositiveOneWins) {
  // As posed volumes: two copies of one tet, and an inverted one before them.
  Model folded;
  folded.nodes.resize(12, 3);
  folded.nodes << 0, 0, 0, 40, 0, 0, 0, 40, 0, 0, 0, 40,  //
      100, 0, 0, 140, 0, 0, 100, 40, 0, 100, 0, 40,       //
      200, 0, 0, 240, 0, 0, 200, 40, 0, 200, 0, 40;
  folded.tets.resize(3, 4);
  folded.tets << 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11;
  folded.tet_label = {7, 8, 9};
  nodes = rest_nodes(folded);
  for (std::size_t tet = 0; tet < 3; ++tet) {
    for (std::size_t n = 4 * tet; n < 4 * tet + 4; ++n) nodes[3 * n] -= 100 * static_cast<float>(tet);
  }
  std::swap_ranges(&nodes[3], &nodes[6], &nodes[6]);  // tet 0 lies the wrong way round
  const Probe of(std::make_shared<const Model>(folded));
  of.follow(nodes, tree);
  const std::vector<float> points{9, 9, 9, 50, 50, 50};
  of.posed_to_rest(tree, points, {}, out);
  EXPECT_EQ(out.tet, (std::vector<std::int32_t>{1, TetPlace::none}));
  EXPECT_EQ(out.label, (std::vector<std::uint16_t>{8, 0}));
  EXPECT_FLOAT_EQ(out.points[0], 109);
  for (std::size_t n : {4U, 8U}) std::swap_ranges(&nodes[3 * n + 3], &nodes[3 * n + 6], &nodes[3 * n + 6]);
  of.follow(nodes, tree);
  of.posed_to_rest(tree, points, {.gradient = true}, out);
  EXPECT_EQ(out.tet[0], 0) << "all three the wrong way round: the lowest";
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> F(out.gradient.data());
  EXPECT_FLOAT_EQ(F.determinant(), -1);
  // Crushed to a sheet it holds nothing.
  for (std::size_t n = 2; n < nodes.size(); n += 3) nodes[n] = 9;
  of.follow(nodes, tree);
  of.posed_to_rest(tree, points, {}, out);
  EXPECT_EQ(out.tet[0], TetPlace::none);
}

TEST_F(ProbeTest, HugeTinyAndFlatBodiesAreSearchedTheSame) {
  // By powers of two nothing is rounded but in steps of boxes; the largest are wider than a float can say,
  // the smallest count as points.
  fold(2.7);
  for (std::size_t n = 2; n < nodes.size(); n += 3) nodes[n] -= 150;
  const std::vector<float> body = nodes, points = random_points(body, 2000);
  probe.follow(body, tree);
  probe.posed_to_rest(tree, points, {}, out);
  const std::vector<std::int32_t> tets = out.tet;
  expect_exhaustive(body, points, true);
  const auto scaled = [](std::vector<float> x, const std::array<int, 3>& by) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::ldexp(x[i], by[i % 3]);
    return x;
  };
  test::for_instruction_sets([&] {
    for (const int by : {-112, -60, -20, 20, 60, 119, 120}) {
      probe.follow(scaled(body, {by, by, by}), tree);
      probe.posed_to_rest(tree, scaled(points, {by, by, by}), {}, out);
      EXPECT_EQ(out.tet, tets) << by;
    }
    for (const std::array<int, 3>& by :
         {std::array{0, 0, -10}, std::array{-12, 0, 0}, std::array{3, -7, 4}}) {
      nodes = scaled(body, by);
      const std::vector<float> there = scaled(points, by);
      probe.follow(nodes, tree);
      probe.posed_to_rest(tree, there, {}, out);
      expect_exhaustive(nodes, there, true);
    }
  });
}

TEST_F(ProbeTest, WhatIsNoNumberOrEndlessLiesOutside) {
  bend(1.0);
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  std::vector<float> points;
  for (const float x : {nan, inf, -inf, 3e38F}) {
    for (std::size_t a = 0; a < 3; ++a) {
      std::array<float, 3> point{0, 0, 100};
      point[a] = x;
      points.insert(points.end(), point.begin(), point.end());
    }
  }
  const std::vector<float> within{0, 0, 100};
  points.insert(points.end(), within.begin(), within.end());
  probe.rest_to_posed(tree, points, {.volumes = {{0}}}, out);
  EXPECT_GE(out.tet.back(), 0);
  EXPECT_EQ(std::count(out.tet.begin(), out.tet.end(), TetPlace::none), 12);
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(out.values[0][i], model->volumes[0].background);
}

}  // namespace
}  // namespace ecorche::runtime
