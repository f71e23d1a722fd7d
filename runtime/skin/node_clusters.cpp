// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/node_clusters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>

#include <ecorche/values/error.hpp>
#include "runtime/skin/unfit.hpp"

namespace ecorche::runtime {
namespace {

constexpr float kSmallestWeight = 1e-4F;  // 0.08 mm on the reference body; below it memory traffic is wasted
constexpr std::size_t kClusterSize = NodeClusters::size;
constexpr std::size_t kOtherRun = 2048;  // of nodes that no tissue hangs on

void check(const Model& model) {
  const Weights& stored = model.weights;
  if (stored.offsets.size() != model.node_count() + 1 || stored.segment.size() != stored.weight.size() ||
      stored.offsets.back() != stored.weight.size()) {
    unfit(model, "its weights do not fit its nodes");
  }
  if (!std::is_sorted(stored.offsets.begin(), stored.offsets.end())) {
    unfit(model, "its weights are out of order");
  }
  for (const std::uint16_t segment : stored.segment) {
    if (segment >= model.segment_count()) unfit(model, "a weight names an absent segment");
  }
  if (model.cor.has_centre.size() != model.node_count() || model.cor.centre.rows() != model.nodes.rows()) {
    unfit(model, "its centres of rotation do not fit its nodes");
  }
}

// What is kept of the weights of one node.
struct Row {
  std::vector<std::uint16_t> segment;
  std::vector<double> weight;
  std::vector<std::uint16_t> quantised;

  void read(const Model& model, std::size_t node) {
    segment.clear();
    weight.clear();
    double sum = 0;
    for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
      if (!(model.weights.weight[e] >= kSmallestWeight)) continue;
      segment.push_back(model.weights.segment[e]);
      weight.push_back(static_cast<double>(model.weights.weight[e]));
      sum += weight.back();
    }
    if (!(sum > 0) || !std::isfinite(sum)) unfit(model, "node " + std::to_string(node) + " has no weight");
    for (double& w : weight) w /= sum;
    quantised.resize(weight.size());
    quantise_weights(weight, quantised);
  }
};

// `rows`: of the cluster's nodes, to be filled.
void add_cluster(const Model& model, std::span<const std::uint32_t> nodes,
                 std::array<Row, kClusterSize>& rows, NodeClusters& out) {
  const std::size_t first = out.palette.size();
  for (std::size_t i = 0; i < kClusterSize; ++i) {
    Row& row = rows[i];
    row.read(model, nodes[i]);
    out.palette.insert(out.palette.end(), row.segment.begin(), row.segment.end());
    // Kept short: a node has few segments, but a cluster of many nodes would hold each of them 64 times.
    std::sort(out.palette.begin() + static_cast<std::ptrdiff_t>(first), out.palette.end());
    out.palette.erase(
        std::unique(out.palette.begin() + static_cast<std::ptrdiff_t>(first), out.palette.end()),
        out.palette.end());
  }
  out.begin.push_back(static_cast<std::uint32_t>(out.palette.size()));
  out.weight.resize(kClusterSize * out.palette.size());
  for (std::size_t i = 0; i < kClusterSize; ++i) {
    const Row& row = rows[i];
    for (std::size_t e = 0; e < row.segment.size(); ++e) {
      const auto place = std::lower_bound(out.palette.begin() + static_cast<std::ptrdiff_t>(first),
                                          out.palette.end(), row.segment[e]) -
                         out.palette.begin();
      // A row that names a segment twice is summed.
      std::uint16_t& weight = out.weight[kClusterSize * static_cast<std::size_t>(place) + i];
      weight = static_cast<std::uint16_t>(weight + row.quantised[e]);
    }
  }
  for (int c = 0; c < 3; ++c) {
    for (const std::uint32_t node : nodes) out.rest.push_back(model.nodes(node, c));
    for (const std::uint32_t node : nodes) {
      out.centre.push_back(model.cor.has_centre[node] != 0 ? model.cor.centre(node, c)
                                                           : model.nodes(node, c));
    }
  }
}

// Along the longest side of the box about them. Places in whole 65535ths of it, counted: there may be
// millions.
void sort_along(const Model& model, std::span<std::uint32_t> nodes) {
  if (nodes.empty()) return;
  Eigen::RowVector3f low = model.nodes.row(nodes[0]), high = low;
  for (const std::uint32_t node : nodes) {
    low = low.cwiseMin(model.nodes.row(node));
    high = high.cwiseMax(model.nodes.row(node));
  }
  Eigen::Index axis = 0;
  const float length = (high - low).maxCoeff(&axis);
  if (!(length > 0)) return;
  const auto place = [&](std::uint32_t node) {
    return static_cast<std::size_t>((model.nodes(node, axis) - low[axis]) / length * 65535);
  };
  std::vector<std::uint32_t> next(65537);
  for (const std::uint32_t node : nodes) ++next[place(node) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  const std::vector<std::uint32_t> before(nodes.begin(), nodes.end());
  for (const std::uint32_t node : before) nodes[next[place(node)]++] = node;
}

// Nodes that hang on the same segments, and of these such as are of one kind, next to each other within each
// run: clusters share short palettes, and a frame of few tissues skins few of them.
void sort_runs(const Model& model, std::span<const std::uint32_t> kind, std::span<std::uint32_t> nodes,
               std::size_t run) {
  std::vector<std::tuple<std::uint64_t, std::uint32_t, std::uint32_t>> keyed;
  for (std::size_t first = 0; first < nodes.size(); first += run) {
    const std::span<std::uint32_t> part = nodes.subspan(first, std::min(run, nodes.size() - first));
    keyed.clear();
    for (const std::uint32_t node : part) {
      std::uint64_t segments = 0;  // beyond 64 segments some share a bit: a worse order, nothing else
      for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
        if (model.weights.weight[e] >= kSmallestWeight)
          segments |= std::uint64_t{1} << model.weights.segment[e] % 64U;
      }
      keyed.emplace_back(segments, kind[node], node);
    }
    std::sort(keyed.begin(), keyed.end());
    for (std::size_t i = 0; i < part.size(); ++i) part[i] = std::get<2>(keyed[i]);
  }
}

}  // namespace

void quantise_weights(std::span<const double> weights, std::span<std::uint16_t> out) {
  constexpr int whole = 65535;
  int left = whole;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    out[i] = static_cast<std::uint16_t>(std::clamp(std::floor(weights[i] * whole), 0.0, double{whole}));
    left -= out[i];
  }
  // At most one a weight is left over; a row is short, so the largest remainder is looked for each time.
  for (; left > 0; --left) {
    std::size_t best = 0;
    double most = -2;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double remainder = weights[i] * whole - out[i];
      if (remainder > most) {
        most = remainder;
        best = i;
      }
    }
    ++out[best];
  }
}

NodeClusters cluster_nodes(const Model& model, std::span<const std::uint32_t> kind) {
  check(model);
  NodeClusters out;
  out.nodes = model.node_count();
  for (const bool wanted : {true, false}) {
    for (std::size_t n = 0; n < out.nodes; ++n) {
      if ((kind[n] != 0) == wanted) out.node.push_back(static_cast<std::uint32_t>(n));
    }
    if (wanted) out.needed = out.node.size();
  }
  const std::span<std::uint32_t> needed = std::span(out.node).first(out.needed);
  sort_along(model, needed);
  sort_runs(model, kind, needed, NodeClusters::slab);
  sort_runs(model, kind, std::span(out.node).subspan(out.needed), kOtherRun);
  out.lane.resize(out.nodes);
  for (std::size_t i = 0; i < out.nodes; ++i) out.lane[out.node[i]] = static_cast<std::uint32_t>(i);
  out.node.resize((out.nodes + kClusterSize - 1) / kClusterSize * kClusterSize, out.node.back());

  out.begin.push_back(0);
  out.rest.reserve(3 * out.node.size());
  out.centre.reserve(3 * out.node.size());
  std::array<Row, kClusterSize> rows;
  for (std::size_t c = 0; c < out.clusters(); ++c) {
    add_cluster(model, std::span(out.node).subspan(kClusterSize * c, kClusterSize), rows, out);
  }
  return out;
}

}  // namespace ecorche::runtime
