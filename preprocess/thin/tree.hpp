// SPDX-License-Identifier: Apache-2.0
// The skeleton tree (Gagvani01 3.3): which skeletal voxel hangs on which.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>

namespace ecorche::thin {

struct TreeOptions {
  /// What a step counts beside the change of the distance: the paper takes 0.7 to 0.95; this is their middle.
  double alpha = 0.825;
  static constexpr double least_alpha = 0.7, most_alpha = 0.95;
  /// Voxels at most this far apart are neighbours. 3 bridges what thinning at the paper's 0.48 opens.
  int reach = 3;
  static constexpr int least_reach = 1, most_reach = 64;
  /// Join the components that are left over twice the reach, then four times, until there is one.
  bool connect = false;
};

/// A distance in voxels, whatever the metric stores.
double length(DistanceMetric metric, std::uint32_t distance);

/// Weight of the edge between two rows: alpha * |i - j| + (1 - alpha) * |DT_i - DT_j|, in voxels.
double edge_weight(const VolumetricSkeleton& skeleton, std::size_t a, std::size_t b, double alpha);

/// VolumetricSkeleton::parent of the minimum spanning tree of every component of the neighbourhood graph,
/// edges of equal weight in the order of their lower, then their higher row, so that there is only one. Each
/// is rooted at its deepest voxel, the first among equals. Boruvka's method, on all threads, the same bytes
/// for any number of them; O(voxels) memory. With `connect` a component's own tree stays the minimum one, and
/// what is added is minimal among the pairs that the wider reach sees. Throws Error{usage} for an option out
/// of its range.
std::vector<std::int32_t> spanning_tree(const VolumetricSkeleton& skeleton, const TreeOptions& options,
                                        const Context& context);

/// The roots among `parent`: as many as components.
std::size_t component_count(const std::vector<std::int32_t>& parent);

/// Rows, every parent before its children.
std::vector<std::int32_t> parents_first(const std::vector<std::int32_t>& parent);

}  // namespace ecorche::thin
