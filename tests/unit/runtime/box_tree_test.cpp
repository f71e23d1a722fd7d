// SPDX-License-Identifier: Apache-2.0
// The tree of boxes that is fitted where points come to, against one that is fitted whole.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <thread>

#include <ecorche/runtime/probe.hpp>

#include "tests/support/instruction_sets.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kTetsOfBlock = 4096;

// A block of bricks, six tets each, and three nodes that no tet has.
Model bricks(int across, int up) {
  Model model;
  const auto node = [&](int i, int j, int k) { return (k * (across + 1) + j) * (across + 1) + i; };
  const int nodes = node(across, across, up) + 1;
  model.nodes.setConstant(nodes + 3, 3, 1e4F);
  for (int k = 0; k <= up; ++k) {
    for (int j = 0; j <= across; ++j) {
      for (int i = 0; i <= across; ++i)
        model.nodes.row(node(i, j, k)) << static_cast<float>(i), static_cast<float>(j), static_cast<float>(k);
    }
  }
  model.tets.resize(6 * across * across * up, 4);
  constexpr int kPaths[6][3] = {{1, 2, 4}, {2, 4, 1}, {4, 1, 2}, {2, 1, 4}, {1, 4, 2}, {4, 2, 1}};
  Eigen::Index t = 0;
  for (int brick = 0; brick < across * across * up; ++brick) {
    const int i = brick % across, j = brick / across % across, k = brick / (across * across);
    for (int path = 0; path < 6; ++path, ++t) {
      int at = 0;
      for (int c = 0; c < 4; ++c) {
        model.tets(t, c) = node(i + (at & 1), j + (at >> 1 & 1), k + (at >> 2 & 1));
        if (c < 3) at |= kPaths[path][c];
      }
      if (path > 2) std::swap(model.tets(t, 2), model.tets(t, 3));
    }
  }
  model.tet_label.assign(static_cast<std::size_t>(model.tets.rows()), 1);
  return model;
}

class BoxTreeTest : public testing::Test {
 protected:
  BoxTreeTest()
      : model(std::make_shared<const Model>(bricks(14, 60))),
        runs(model->tets, model->nodes),
        probe(model),
        rest(model->nodes.data(), model->nodes.data() + model->nodes.size()) {}

  // Bent by `turn` from one end to the other, and shaken.
  std::vector<float> posed(double turn) {
    std::vector<float> nodes = rest;
    std::uniform_real_distribution<float> shake(-0.2F, 0.2F);
    for (std::size_t n = 0; n < nodes.size(); n += 3) {
      const double angle = turn * static_cast<double>(rest[n + 2]) / 60;
      const double y = static_cast<double>(rest[n + 1]), z = static_cast<double>(rest[n + 2]);
      nodes[n] += shake(random);
      nodes[n + 1] = static_cast<float>(std::cos(angle) * y - std::sin(angle) * z) + shake(random);
      nodes[n + 2] = static_cast<float>(std::sin(angle) * y + std::cos(angle) * z) + shake(random);
    }
    return nodes;
  }
  // In the box about the nodes that tets have, some outside the body.
  std::vector<float> points_about(const std::vector<float>& nodes, std::size_t count) {
    std::vector<float> points;
    std::uniform_int_distribution<std::size_t> which(0, nodes.size() / 3 - 4);
    std::normal_distribution<float> beside(0, 1);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t node = which(random);
      for (std::size_t a = 0; a < 3; ++a) points.push_back(nodes[3 * node + a] + beside(random));
    }
    return points;
  }
  Probed ask_fitted(const std::vector<float>& nodes, const std::vector<float>& points) const {
    Probe::PosedTree whole;
    probe.follow(nodes, whole);
    probe.fit(whole);
    EXPECT_EQ(fitted(whole), runs.blocks());
    Probed out;
    probe.posed_to_rest(whole, points, {.gradient = true}, out);
    return out;
  }

  static std::size_t fitted(const Probe::PosedTree& tree) {
    return static_cast<std::size_t>(
        std::count_if(tree.boxes.blocks.begin(), tree.boxes.blocks.end(),
                      [](const auto& state) { return state.load() == BoxTree::State::fitted; }));
  }
  static void expect_same(const Probed& a, const Probed& b) {
    EXPECT_EQ(a.tet, b.tet);
    const auto same = [](const std::vector<float>& x, const std::vector<float>& y) {
      return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(float)) == 0;
    };
    EXPECT_TRUE(same(a.barycentric, b.barycentric) && same(a.points, b.points) &&
                same(a.gradient, b.gradient));
  }

  std::shared_ptr<const Model> model;
  TetRuns runs;
  Probe probe;
  std::vector<float> rest;
  std::mt19937 random{8};
};

TEST_F(BoxTreeTest, BlocksAreBoundedByTheirTets) {
  // The same boxes from the mesh, tet by tet, at every level above the blocks.
  ASSERT_EQ(runs.blocks(), (6 * 14 * 14 * 60 + kTetsOfBlock - 1) / kTetsOfBlock);
  ASSERT_EQ(runs.levels(), 4U);
  test::for_instruction_sets([&] {
    const std::vector<float> nodes = posed(1.5);
    Probe::PosedTree tree;
    probe.follow(nodes, tree);
    for (std::size_t level = 2; level < runs.levels(); ++level) {
      for (std::size_t child = 0; child < runs.nodes(level - 1); ++child) {
        const std::size_t width = level == 2 ? 1 : 16;  // blocks
        std::array<float, 3> low, high;
        low.fill(std::numeric_limits<float>::infinity());
        high.fill(-std::numeric_limits<float>::infinity());
        for (std::size_t r = 256 * width * child; r < std::min(runs.runs(), 256 * width * (child + 1)); ++r) {
          for (std::size_t corner = 0; corner < 64; ++corner) {
            const auto t = static_cast<Eigen::Index>(runs.tets(r)[corner / 4]);
            const auto n = static_cast<std::size_t>(model->tets(t, static_cast<Eigen::Index>(corner % 4)));
            for (std::size_t a = 0; a < 3; ++a) {
              low[a] = std::min(low[a], nodes[3 * n + a]);
              high[a] = std::max(high[a], nodes[3 * n + a]);
            }
          }
        }
        const BoxNode& above = tree.boxes.above[runs.first(level) + child / 16];
        for (std::size_t a = 0; a < 3; ++a) {
          ASSERT_EQ(above.low[a][child % 16], low[a]) << level << " " << child;
          ASSERT_EQ(above.high[a][child % 16], high[a]) << level << " " << child;
        }
      }
    }
    EXPECT_EQ(fitted(tree), 0U);
  });
}

TEST_F(BoxTreeTest, PointsSeeTheSameWhicheverBlockIsFittedWhen) {
  test::for_instruction_sets([&] {
    const std::vector<float> nodes = posed(1.0), points = points_about(nodes, 400);
    const Probed whole = ask_fitted(nodes, points);
    ASSERT_GT(std::count_if(whole.tet.begin(), whole.tet.end(), [](auto t) { return t >= 0; }), 200);
    Probe::PosedTree together, one_by_one;
    probe.follow(nodes, together);
    Probed out;
    probe.posed_to_rest(together, points, {.gradient = true}, out);
    expect_same(out, whole);
    probe.follow(nodes, one_by_one);
    const std::vector<float> first(points.begin(), points.begin() + 3);
    probe.posed_to_rest(one_by_one, first, {}, out);
    EXPECT_LT(fitted(one_by_one), 6U) << "others are left alone";
    for (std::size_t i = 0; i < whole.tet.size(); ++i) {
      probe.posed_to_rest(one_by_one, std::span(points).subspan(3 * i, 3), {}, out);
      ASSERT_EQ(out.tet[0], whole.tet[i]);
    }
    EXPECT_GT(fitted(one_by_one), runs.blocks() / 2);
  });
}

TEST_F(BoxTreeTest, ItsSizeIsKnownBeforeItIsMade) {
  Probe::PosedTree tree;
  probe.follow(rest, tree);
  const auto bytes = [](const auto& all) { return static_cast<double>(all.size() * sizeof(all[0])); };
  const double actual = bytes(tree.nodes) + bytes(tree.boxes.above) + bytes(tree.boxes.lowest) +
                        bytes(tree.boxes.runs) + bytes(tree.boxes.blocks);
  EXPECT_NEAR(
      static_cast<double>(tree_bytes(static_cast<std::uint64_t>(model->tets.rows()), rest.size() / 3)),
      actual, 0.02 * actual);
}

TEST_F(BoxTreeTest, NothingOfAnEarlierPoseIsLeft) {
  // All is asked of some poses, a corner or nothing of the others.
  Probe::PosedTree kept;
  Probed out;
  for (int turn = 0; turn < 8; ++turn) {
    const std::vector<float> nodes = posed(0.4 * turn - 1);
    const std::vector<float> points = points_about(nodes, turn % 3 == 0 ? 500 : turn % 3);
    probe.follow(nodes, kept);
    EXPECT_EQ(fitted(kept), 0U);
    if (points.empty()) continue;
    probe.posed_to_rest(kept, points, {.gradient = true}, out);
    expect_same(out, ask_fitted(nodes, points));
  }
}

TEST_F(BoxTreeTest, TheWayThereNeedsNoBlock) {
  const std::vector<float> nodes = posed(0.8), points = points_about(rest, 300);
  Probe::PosedTree tree, whole;
  probe.follow(nodes, tree);
  Probed out, expected;
  probe.rest_to_posed(tree, points, {.gradient = true}, out);
  EXPECT_EQ(fitted(tree), 0U);
  probe.follow(nodes, whole);
  probe.fit(whole);
  probe.rest_to_posed(whole, points, {.gradient = true}, expected);
  expect_same(out, expected);
  ASSERT_GT(std::count_if(out.tet.begin(), out.tet.end(), [](auto t) { return t >= 0; }), 150);
  // Where the points went they are found again, by blocks that nobody had asked for.
  std::erase_if(out.points, [](float x) { return std::isnan(x); });
  probe.posed_to_rest(tree, out.points, {.gradient = true}, expected);
  expect_same(expected, ask_fitted(nodes, out.points));
}

TEST_F(BoxTreeTest, ManyThreadsAskOneFreshTree) {
  // They meet at the same blocks, from the same end and from both.
  Probe::PosedTree tree;
  for (int turn = 0; turn < 6; ++turn) {
    const std::vector<float> nodes = posed(0.3 * turn), points = points_about(nodes, 120);
    const Probed whole = ask_fitted(nodes, points);
    probe.follow(nodes, tree);
    std::vector<std::vector<std::int32_t>> found(4, std::vector<std::int32_t>(120));
    std::vector<std::thread> threads;
    for (std::size_t thread = 0; thread < found.size(); ++thread) {
      threads.emplace_back([&, thread] {
        Probed out;
        for (std::size_t turned = 0; turned < 120; ++turned) {
          const std::size_t i = thread % 2 == 0 ? turned : 119 - turned;
          probe.posed_to_rest(tree, std::span(points).subspan(3 * i, 3), {}, out);
          found[thread][i] = out.tet[0];
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    for (const std::vector<std::int32_t>& tets : found) EXPECT_EQ(tets, whole.tet);
  }
}

TEST(BoxTree, OneBlockIsFittedAtOnce) {
  const auto model = std::make_shared<const Model>(bricks(5, 9));
  const Probe probe(model);
  Probe::PosedTree tree;
  const std::vector<float> nodes(model->nodes.data(), model->nodes.data() + model->nodes.size());
  probe.follow(nodes, tree);
  ASSERT_EQ(tree.boxes.blocks.size(), 1U);
  EXPECT_EQ(tree.boxes.blocks[0].load(), BoxTree::State::fitted);
  Probed out;
  std::vector<float> points(std::size_t{3} * 50);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = 0.3F + static_cast<float>(i % 7) * 0.7F;
  probe.posed_to_rest(tree, points, {}, out);
  EXPECT_EQ(std::count(out.tet.begin(), out.tet.end(), TetPlace::none), 0);
}

}  // namespace
}  // namespace ecorche::runtime
