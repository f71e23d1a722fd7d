// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/node_clusters.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

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

bool is_kept(float weight) {
  return weight >= kSmallestWeight;
}

// What is kept of the weights of one node.
struct Row {
  std::vector<std::uint16_t> segment;
  std::vector<double> weight;
  std::vector<std::uint16_t> quantised;

  // False where it has none.
  bool read(const Model& model, std::size_t node) {
    segment.clear();
    weight.clear();
    double sum = 0;
    for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
      if (!is_kept(model.weights.weight[e])) continue;
      segment.push_back(model.weights.segment[e]);
      weight.push_back(static_cast<double>(model.weights.weight[e]));
      sum += weight.back();
    }
    if (!(sum > 0) || !std::isfinite(sum)) return false;
    for (double& w : weight) w /= sum;
    quantised.resize(weight.size());
    quantise_weights(weight, quantised);
    return true;
  }
};

using Nodes = std::span<const std::uint32_t>;

Nodes nodes_of(std::size_t cluster, const NodeClusters& out) {
  return Nodes(out.node).subspan(kClusterSize * cluster, kClusterSize);
}

// Clusters do not depend on each other.
template <class Each>
void for_slabs(const NodeClusters& out, Each&& each) {
  constexpr std::size_t of_slab = NodeClusters::slab / kClusterSize;
  tbb::parallel_for(std::size_t{0}, out.slabs(), [&](std::size_t slab) {
    each(slab, of_slab * slab, std::min(out.clusters(), of_slab * (slab + 1)));
  });
}

// The segments that any of the nodes hangs on, ascending.
class Palette {
 public:
  explicit Palette(std::size_t segments) : bits_((segments + 63) / 64) {}

  const std::vector<std::uint16_t>& of(const Model& model, Nodes nodes) {
    for (const std::uint32_t node : nodes) {
      for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
        const std::uint16_t segment = model.weights.segment[e];
        if (is_kept(model.weights.weight[e])) bits_[segment / 64] |= std::uint64_t{1} << segment % 64U;
      }
    }
    segments_.clear();
    for (std::size_t word = 0; word < bits_.size(); ++word) {
      for (std::uint64_t bits = std::exchange(bits_[word], 0); bits != 0; bits &= bits - 1)
        segments_.push_back(static_cast<std::uint16_t>(64 * word + std::countr_zero(bits)));
    }
    return segments_;
  }

 private:
  std::vector<std::uint64_t> bits_;
  std::vector<std::uint16_t> segments_;
};

void add_palettes(const Model& model, NodeClusters& out) {
  std::vector<std::vector<std::uint16_t>> of_slab(out.slabs());
  out.begin.assign(out.clusters() + 1, 0);
  for_slabs(out, [&](std::size_t slab, std::size_t first, std::size_t end) {
    Palette palette(model.segment_count());
    for (std::size_t c = first; c < end; ++c) {
      const std::vector<std::uint16_t>& segments = palette.of(model, nodes_of(c, out));
      of_slab[slab].insert(of_slab[slab].end(), segments.begin(), segments.end());
      out.begin[c + 1] = static_cast<std::uint32_t>(segments.size());
    }
  });
  std::partial_sum(out.begin.begin(), out.begin.end(), out.begin.begin());
  out.palette.reserve(out.begin.back());
  for (const auto& segments : of_slab)
    out.palette.insert(out.palette.end(), segments.begin(), segments.end());
}

// False where one of its nodes has no weight.
bool fill_weights(const Model& model, std::size_t cluster, Row& row, NodeClusters& out) {
  const Nodes nodes = nodes_of(cluster, out);
  const auto first = out.palette.begin() + static_cast<std::ptrdiff_t>(out.begin[cluster]),
             end = out.palette.begin() + static_cast<std::ptrdiff_t>(out.begin[cluster + 1]);
  for (std::size_t i = 0; i < kClusterSize; ++i) {
    if (!row.read(model, nodes[i])) return false;
    for (std::size_t e = 0; e < row.segment.size(); ++e) {
      const auto place = std::lower_bound(first, end, row.segment[e]) - out.palette.begin();
      // A row that names a segment twice is summed.
      std::uint16_t& weight = out.weight[kClusterSize * static_cast<std::size_t>(place) + i];
      weight = static_cast<std::uint16_t>(weight + row.quantised[e]);
    }
  }
  return true;
}

void fill_places(const Model& model, std::size_t cluster, NodeClusters& out) {
  const Nodes nodes = nodes_of(cluster, out);
  for (std::size_t c = 0; c < 3; ++c) {
    const auto column = static_cast<Eigen::Index>(c);
    float* const rest = &out.rest[kClusterSize * (3 * cluster + c)];
    float* const centre = &out.centre[kClusterSize * (3 * cluster + c)];
    for (std::size_t i = 0; i < kClusterSize; ++i) {
      rest[i] = model.nodes(nodes[i], column);
      centre[i] = model.cor.has_centre[nodes[i]] != 0 ? model.cor.centre(nodes[i], column) : rest[i];
    }
  }
}

// Of the first in the order of lanes, for any number of threads.
[[noreturn]] void refuse_weightless(const Model& model, const NodeClusters& out) {
  Row row;
  const auto first = std::find_if(out.node.begin(), out.node.end(),
                                  [&](std::uint32_t node) { return !row.read(model, node); });
  unfit(model, "node " + std::to_string(*first) + " has no weight");
}

void fill_clusters(const Model& model, NodeClusters& out) {
  // Fresh memory takes as long as what is written there.
  tbb::parallel_invoke([&] { out.rest.resize(3 * out.node.size()); },
                       [&] { out.centre.resize(3 * out.node.size()); },
                       [&] { out.weight.resize(kClusterSize * out.palette.size()); });
  std::atomic<bool> weighted = true;
  for_slabs(out, [&](std::size_t, std::size_t first, std::size_t end) {
    Row row;
    for (std::size_t c = first; c < end; ++c) {
      if (!fill_weights(model, c, row, out)) weighted = false;
      fill_places(model, c, out);
    }
  });
  if (!weighted) refuse_weightless(model, out);
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
  std::vector<std::uint16_t> place;
  place.reserve(nodes.size());
  for (const std::uint32_t node : nodes)
    place.push_back(static_cast<std::uint16_t>((model.nodes(node, axis) - low[axis]) / length * 65535));
  std::vector<std::uint32_t> next(65537);
  for (const std::uint16_t p : place) ++next[p + std::size_t{1}];
  std::partial_sum(next.begin(), next.end(), next.begin());
  const std::vector<std::uint32_t> before(nodes.begin(), nodes.end());
  for (std::size_t i = 0; i < before.size(); ++i) nodes[next[place[i]]++] = before[i];
}

// Nodes that hang on the same segments, and of these such as are of one kind, next to each other within each
// run: clusters share short palettes, and a frame of few tissues skins few of them.
void sort_runs(const Model& model, std::span<const std::uint32_t> kind, std::span<std::uint32_t> nodes,
               std::size_t run) {
  const auto sort_run = [&](std::size_t first) {
    const std::span<std::uint32_t> part = nodes.subspan(first, std::min(run, nodes.size() - first));
    std::vector<std::tuple<std::uint64_t, std::uint32_t, std::uint32_t>> keyed;
    keyed.reserve(part.size());
    for (const std::uint32_t node : part) {
      std::uint64_t segments = 0;  // beyond 64 segments some share a bit: a worse order, nothing else
      for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
        if (is_kept(model.weights.weight[e])) segments |= std::uint64_t{1} << model.weights.segment[e] % 64U;
      }
      keyed.emplace_back(segments, kind[node], node);
    }
    std::sort(keyed.begin(), keyed.end());
    for (std::size_t i = 0; i < part.size(); ++i) part[i] = std::get<2>(keyed[i]);
  };
  const std::size_t runs = (nodes.size() + run - 1) / run;
  tbb::parallel_for(std::size_t{0}, runs, [&](std::size_t r) { sort_run(r * run); });
}

}  // namespace

void quantise_weights(std::span<const double> weights, std::span<std::uint16_t> out) {
  constexpr int whole = 65535;
  int left = whole;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    out[i] = static_cast<std::uint16_t>(std::clamp(weights[i] * whole, 0.0, double{whole}));  // rounded down
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
  out.node.reserve(out.nodes + kClusterSize);
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

  add_palettes(model, out);
  fill_clusters(model, out);
  return out;
}

}  // namespace ecorche::runtime
