// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/skin_clusters.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>

namespace ecorche::runtime {
namespace {

// 2048 nodes a task: large enough to hide the scheduler, small enough that what was skinned is still in the
// first cache when it is handed on to `nodes`.
constexpr std::size_t kClustersPerTask = 32;

void hand_on_one(const SkinClusters& job, std::size_t cluster) {
  const std::size_t first = NodeClusters::size * cluster;
  const std::size_t end = std::min(first + NodeClusters::size, job.layout.nodes);
  for (std::size_t lane = first; lane < end; ++lane) {
    std::memcpy(&job.nodes[3 * std::size_t{job.layout.node[lane]}], &job.posed[3 * lane], 3 * sizeof(float));
  }
}

template <class Kernel>
void run(const SkinClusters& job, Kernel kernel) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, job.clusters.size(), kClustersPerTask),
                    [&job, kernel](const auto& range) {
                      kernel(job, range.begin(), range.end());
                      if (!job.nodes.empty()) kernels::hand_on(job, range.begin(), range.end());
                    });
}

}  // namespace

void kernels::hand_on(const SkinClusters& job, std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) hand_on_one(job, job.clusters[i]);
}

std::string_view SkinClusters::check() const {
  if (motions.empty()) return "no segment moves";
  if (posed.size() != 3 * layout.node.size()) return "posed has not three coordinates a lane";
  if (!nodes.empty() && nodes.size() != 3 * layout.nodes) return "nodes has not three coordinates a node";
  return {};
}

void SkinClusters::lbs() const {
  run(*this, kernels::lbs);
}

void SkinClusters::dqs() const {
  run(*this, kernels::dqs);
}

void SkinClusters::cor() const {
  run(*this, kernels::cor);
}

}  // namespace ecorche::runtime
