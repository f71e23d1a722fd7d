// SPDX-License-Identifier: Apache-2.0
// The tet nodes as the skinning kernels read them: bytes per node decide, since memory is the limit.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/aligned.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// Clusters of 64 nodes with one palette of segments each and a dense planar weight for every pair of them:
/// no index per node, no gather. First the nodes that some tissue hangs on (those not of kind 0), in slabs
/// across the longest side of the box about them; then the others in the model's own order (Morton), in runs
/// of 2048. Slabs and runs are sorted by the segments that nodes hang on, then by kind. A *lane* is a place
/// in this order: node `node[lane]`. The last cluster repeats its last node.
struct NodeClusters {
  static constexpr std::size_t size = 64;
  /// Of 128 clusters. What hangs on its nodes reaches into a few others: posed, they stay in a core's cache.
  static constexpr std::size_t slab = 128 * size;

  std::size_t nodes = 0;   ///< lanes that count
  std::size_t needed = 0;  ///< of them, those not of kind 0 come first

  std::vector<std::uint32_t> node;  ///< 64 * #clusters
  std::vector<std::uint32_t> lane;  ///< #nodes, where a node is
  Aligned<float> rest;              ///< 64 x, 64 y, 64 z a cluster, LPS mm
  Aligned<float> centre;  ///< as `rest`; the node itself where it has no centre, which makes CoR LBS
  std::vector<std::uint32_t> begin;    ///< #clusters + 1, into `palette`
  std::vector<std::uint16_t> palette;  ///< segments of a cluster, ascending; at least one
  Aligned<std::uint16_t> weight;       ///< 64 an entry of `palette`; those of a lane sum to exactly 65535

  std::size_t clusters() const { return node.size() / size; }
  std::size_t slabs() const { return (node.size() + slab - 1) / slab; }
};

/// Weights below 1e-4 are dropped and their rows renormalised. `kind`: #nodes, the same for nodes
/// that the same tissues hang on, 0 for those without one: so a frame of few tissues skins few clusters.
/// Throws Error{data} where weights or centres do not fit the nodes.
NodeClusters cluster_nodes(const Model& model, std::span<const std::uint32_t> kind);

/// `weights`, which sum to about 1, in whole 65535ths that sum to exactly 65535: the largest remainders are
/// rounded up, the first of equal ones. Same size; each below 1 / 65535 off.
void quantise_weights(std::span<const double> weights, std::span<std::uint16_t> out);

}  // namespace ecorche::runtime
