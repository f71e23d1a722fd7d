// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/arithmetic_floor.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <numeric>
#include <vector>

#include "runtime/skin/skin_clusters.hpp"

namespace ecorche::bench {
namespace {

using runtime::VertexGroups;

// Of each a piece holds at most 20 kB, inputs and results.
constexpr std::size_t kClusters = 4, kCells = 4, kBoneVertices = 512;
constexpr std::size_t kMostPieces = 512;  // of one kind
constexpr int kTimes = 64;

// Piece p of `count` is work(p). Milliseconds of all, shared out among the arena's threads.
double in_cache(std::size_t count, const std::function<void(std::size_t)>& work) {
  if (count == 0) return 0;
  const std::size_t stride = (count + kMostPieces - 1) / kMostPieces, pieces = (count + stride - 1) / stride;
  std::vector<double> ms(pieces, 0);
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, pieces, 1),
      [&](const auto& range) {
        for (std::size_t p = range.begin(); p < range.end(); ++p) {
          work(stride * p);  // now in the cache
          const auto start = std::chrono::steady_clock::now();
          for (int n = 0; n < kTimes; ++n) work(stride * p);
          const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
          ms[p] = took.count() / kTimes;
        }
      },
      tbb::simple_partitioner());
  const double all =
      std::accumulate(ms.begin(), ms.end(), 0.0) * static_cast<double>(count) / static_cast<double>(pieces);
  return all / tbb::this_task_arena::max_concurrency();
}

std::size_t pieces_of(std::size_t count, std::size_t each) {
  return (count + each - 1) / each;
}

auto kernel_of(runtime::Skinning skinning) {
  switch (skinning) {
    case runtime::Skinning::lbs:
      return runtime::kernels::lbs;
    case runtime::Skinning::dqs:
      return runtime::kernels::dqs;
    case runtime::Skinning::cor:
      break;
  }
  return runtime::kernels::cor;
}

template <class T>
T* data_or_null(std::vector<T>& rows) {
  return rows.empty() ? nullptr : rows.data();
}

}  // namespace

double arithmetic_of_nodes(const runtime::BodyParts& parts, runtime::Skinning skinning,
                           runtime::PosedBody& frame, const runtime::RootMotion& root) {
  const runtime::NodeClusters& clusters = parts.clusters();
  std::vector<std::uint32_t> needed(pieces_of(clusters.needed, runtime::NodeClusters::size));
  std::iota(needed.begin(), needed.end(), 0U);
  const runtime::SkinClusters job{clusters,
                                  frame.scratch.motions,
                                  root,
                                  needed,
                                  std::span(frame.scratch.lanes).first(3 * clusters.node.size()),
                                  {}};
  const auto kernel = kernel_of(skinning);
  return in_cache(pieces_of(needed.size(), kClusters), [&](std::size_t p) {
    kernel(job, kClusters * p, std::min(needed.size(), kClusters * (p + 1)));
  });
}

double arithmetic_of_tissues(const Model& model, const runtime::BodyParts& parts, runtime::PosedBody& frame) {
  double ms = 0;
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    const Tissue& tissue = model.tissues[t];
    const runtime::VertexSink sink{data_or_null(frame.tissues[t]), data_or_null(frame.quantised[t]),
                                   data_or_null(frame.normals[t]), frame.box};
    if (tissue.segment == Tissue::by_tets) {
      const VertexGroups& groups = parts.groups(t);
      const runtime::TissueVertices job{groups, frame.scratch.lanes, sink, 0, 0};
      ms += in_cache(pieces_of(groups.cells.size(), kCells), [&](std::size_t p) {
        runtime::kernels::tissue(job, kCells * p, std::min(groups.cells.size(), kCells * (p + 1)));
      });
      continue;
    }
    const auto vertices = static_cast<std::size_t>(tissue.V.rows());
    const std::span<const float> rest(tissue.V.data(), 3 * vertices);
    const RigidTransform& motion = frame.segments[static_cast<std::size_t>(tissue.segment)];
    // Any unit vectors cost what the bone's own do.
    const std::vector<float> normals(frame.normals[t].empty() ? 0 : 3 * vertices, 0.57735F);
    const runtime::BoneVertices job{rest, normals,
                                    runtime::make_motions({&motion, 1}, runtime::middle_of(rest), {}), sink};
    ms += in_cache(pieces_of(vertices, kBoneVertices), [&](std::size_t p) {
      runtime::kernels::bone(job, kBoneVertices * p, std::min(vertices, kBoneVertices * (p + 1)));
    });
  }
  return ms;
}

}  // namespace ecorche::bench
