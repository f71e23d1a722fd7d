// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/tet_runs.hpp>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "runtime/probe/halving_order.hpp"
#include "runtime/volume/tet_palettes.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kWidth = TetRuns::width, kRunsOfBlock = kWidth * kWidth;
static_assert(kWidth == TetPalettes::width && sizeof(PackedRun) == 64 && sizeof(ByteBoxes) == 128);

BoxNode empty_node() {
  constexpr float far = std::numeric_limits<float>::infinity();
  BoxNode node;
  for (auto& axis : node.low) axis.fill(far);
  for (auto& axis : node.high) axis.fill(-far);
  return node;
}

}  // namespace

TetRuns::TetRuns(const DrawnTets& tets, const PointsF& nodes, std::span<const std::uint32_t> given)
    : tet_(halving_order(tets, nodes, width)) {
  const TetPalettes palettes(tets, tet_, stride);
  const std::size_t runs = palettes.runs();
  if (!tet_.empty()) tet_.resize(width * runs, tet_.back());
  begin_.resize(runs + 1);
  for (std::size_t r = 0; r < runs; ++r)
    begin_[r + 1] = begin_[r] + static_cast<std::uint32_t>(palettes.filled(r));
  rows_.resize(begin_.back());
  corners_.resize(runs);
  // Nodes that no tet has come last.
  const auto count = static_cast<std::uint32_t>(nodes.rows());
  std::vector<std::uint32_t> place(count, count);
  order_.reserve(count);
  const auto come_to = [&](std::uint32_t node) {
    if (place[node] != count) return;
    place[node] = static_cast<std::uint32_t>(order_.size());
    order_.push_back(node);
  };
  for (std::size_t r = 0; r < runs; ++r) {
    if (r % kRunsOfBlock == 0) own_.push_back(static_cast<std::uint32_t>(order_.size()));
    for (const std::uint32_t row : palettes.rows_of(r)) come_to(row / stride);
  }
  if (runs == 0) own_.push_back(0);
  own_.push_back(static_cast<std::uint32_t>(order_.size()));
  for (std::uint32_t node = 0; node < count; ++node) come_to(node);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, runs, 1024), [&](const auto& range) {
    for (std::size_t r = range.begin(); r < range.end(); ++r) {
      const std::uint8_t more = palettes.rows_of(r).size() > PackedRun::most ? unpacked : 0;
      for (std::size_t i = 0; i < palettes.filled(r); ++i)
        rows_[begin_[r] + i] = stride * place[palettes.rows(r)[i] / stride];
      for (std::size_t i = 0; i < corners_[r].size(); ++i)
        corners_[r][i] = static_cast<std::uint8_t>(palettes.corners(r)[i] + more);
    }
  });
  std::size_t level = runs;
  do {
    level = std::max<std::size_t>(1, (level + width - 1) / width);
    nodes_[levels_] = level;
    first_[levels_ + 1] = levels_ == 0 ? 0 : first_[levels_] + level;
    ++levels_;
  } while (level > 1 || levels_ < 2);  // there is a block
  if (!given.empty()) {
    for (std::uint32_t& node : order_) node = given[node];
  }
  find_shared();
}

void TetRuns::find_shared() {
  std::vector<std::vector<std::uint32_t>> shared(blocks());
  tbb::parallel_for(std::size_t{0}, blocks(), [&](std::size_t b) {
    for (std::size_t r = kRunsOfBlock * b; r < std::min(runs(), kRunsOfBlock * (b + 1)); ++r) {
      for (const std::uint32_t row : rows(r)) {
        if (row / stride < own_[b]) shared[b].push_back(order_[row / stride]);
      }
    }
    std::sort(shared[b].begin(), shared[b].end());
    shared[b].erase(std::unique(shared[b].begin(), shared[b].end()), shared[b].end());
  });
  first_shared_.push_back(0);
  for (const std::vector<std::uint32_t>& nodes : shared) {
    shared_.insert(shared_.end(), nodes.begin(), nodes.end());
    first_shared_.push_back(static_cast<std::uint32_t>(shared_.size()));
  }
}

std::uint64_t tree_bytes(std::uint64_t tets, std::uint64_t nodes) {
  const std::uint64_t runs = tets / kWidth + 1, lowest = runs / kWidth + 1;
  return TetRuns::stride * sizeof(float) * nodes + sizeof(PackedRun) * runs + sizeof(ByteBoxes) * lowest +
         sizeof(BoxNode) * (lowest / (kWidth - 1) + 1);
}

void follow(const TetRuns& runs, std::span<const float> nodes, PaddedNodes& padded, BoxTree& tree,
            std::span<const float> copied) {
  const std::size_t levels = runs.levels(), above = runs.first(levels);
  if (tree.above.size() != above || tree.runs.size() != runs.runs() + 1) {
    tree.above.assign(above, empty_node());
    tree.lowest.resize(runs.nodes(0));
    tree.runs.resize(runs.runs() + 1);
    tree.blocks = std::vector<std::atomic<BoxTree::State>>(runs.blocks());
  }
  padded.resize(TetRuns::stride * runs.order().size());
  for (auto& block : tree.blocks) block.store(BoxTree::State::stale, std::memory_order_relaxed);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, runs.blocks(), 8), [&](const auto& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b)
      kernels::bound_block(runs, nodes, copied, padded, tree, b);
  });
  // Points are sorted by the box of the top.
  if (runs.blocks() == 1) return fit_block({runs, padded, tree}, 0);
  for (std::size_t level = 3; level < levels; ++level) {
    for (std::size_t i = 0; i < runs.nodes(level - 1); ++i) {
      const BoxNode& child = tree.above[runs.first(level - 1) + i];
      BoxNode& parent = tree.above[runs.first(level) + i / kWidth];
      for (std::size_t a = 0; a < 3; ++a) {
        parent.low[a][i % kWidth] = *std::min_element(child.low[a].begin(), child.low[a].end());
        parent.high[a][i % kWidth] = *std::max_element(child.high[a].begin(), child.high[a].end());
      }
    }
  }
}

void fit_block(const FindTets& where, std::size_t b) {
  std::atomic<BoxTree::State>& state = where.tree.blocks[b];
  BoxTree::State seen = BoxTree::State::stale;
  if (state.compare_exchange_strong(seen, BoxTree::State::being_fitted, std::memory_order_acquire)) {
    kernels::fit_block(where, b);
    state.store(BoxTree::State::fitted, std::memory_order_release);
    state.notify_all();
  } else if (seen == BoxTree::State::being_fitted) {
    state.wait(seen, std::memory_order_acquire);
  }
}

void fit_blocks(const FindTets& where) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, where.runs.blocks(), 4), [&](const auto& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b) fit_block(where, b);
  });
}

}  // namespace ecorche::runtime
