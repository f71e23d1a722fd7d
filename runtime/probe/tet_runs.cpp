// SPDX-License-Identifier: Apache-2.0
#include "runtime/probe/tet_runs.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "runtime/probe/space_order.hpp"

namespace ecorche::runtime {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

std::vector<std::uint32_t> curve_order(const Tets& tets, const PointsF& nodes) {
  if (tets.rows() == 0) return {};
  const Eigen::RowVector3f low = nodes.colwise().minCoeff(), high = nodes.colwise().maxCoeff();
  const SpaceOrder order({low[0], low[1], low[2]}, {high[0], high[1], high[2]});
  std::vector<std::uint32_t> places(static_cast<std::size_t>(tets.rows()));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size(), 16384), [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      Eigen::RowVector3f middle = Eigen::RowVector3f::Zero();
      for (int c = 0; c < 4; ++c) middle += nodes.row(tets(static_cast<Eigen::Index>(t), c)) / 4;
      places[t] = hilbert_place(order.cell(middle.data()));
    }
  });
  return SpaceOrder::sorted(places);
}

BoxNode empty_node() {
  BoxNode node;
  for (auto& axis : node.low) axis.fill(kFar);
  for (auto& axis : node.high) axis.fill(-kFar);
  return node;
}

}  // namespace

TetRuns::TetRuns(const Tets& tets, const PointsF& nodes)
    : tet_(curve_order(tets, nodes)), palettes_(tets, tet_, stride) {
  std::size_t level = runs();
  do {
    level = std::max<std::size_t>(1, (level + width - 1) / width);
    first_[levels_ + 1] = first_[levels_] + level;
    ++levels_;
  } while (level > 1 || levels_ < 2);  // what is fitted in parallel always has a node above it
  if (!tet_.empty()) tet_.resize(width * runs(), tet_.back());
}

void pad_nodes(std::span<const float> nodes, PaddedNodes& out) {
  out.resize(nodes.size() / 3 * 4);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes.size() / 3, 16384), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      std::copy_n(&nodes[3 * n], 3, &out[4 * n]);
    }
  });
}

void fit_boxes(const TetRuns& runs, const PaddedNodes& nodes, BoxTree& tree) {
  if (tree.size() != runs.tree_nodes()) tree.assign(runs.tree_nodes(), empty_node());
  constexpr std::size_t width = TetRuns::width;
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, runs.first(2) - runs.first(1), 4),
      [&](const auto& range) { kernels::fit_boxes(runs, nodes, tree, range.begin(), range.end()); });
  for (std::size_t level = 2; level < runs.levels(); ++level) {
    for (std::size_t child = runs.first(level - 1); child < runs.first(level); ++child) {
      const std::size_t i = child - runs.first(level - 1);
      BoxNode& parent = tree[runs.first(level) + i / width];
      for (std::size_t a = 0; a < 3; ++a) {
        parent.low[a][i % width] = *std::min_element(tree[child].low[a].begin(), tree[child].low[a].end());
        parent.high[a][i % width] = *std::max_element(tree[child].high[a].begin(), tree[child].high[a].end());
      }
    }
  }
}

}  // namespace ecorche::runtime
