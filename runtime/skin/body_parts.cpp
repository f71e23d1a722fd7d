// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/body_parts.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "runtime/skin/skin_clusters.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kCellsPerBlock = 12;           // some 1000 vertices
constexpr std::size_t kBoneVerticesPerBlock = 2048;  // a multiple of any vector

std::span<const float> floats(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

// Nodes of one kind hold up the same tissues; of kind 0, none.
std::vector<std::uint32_t> kinds_of_nodes(const Model& model) {
  std::vector<std::uint32_t> kind(model.node_count(), 0);
  std::vector<std::int32_t> seen(model.node_count(), -1);
  std::uint32_t kinds = 0;
  std::vector<std::uint32_t> with;  // by kind: the same and this tissue
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    with.assign(kinds + 1, 0);
    for (const std::int32_t tet : model.tissues[t].tet) {
      for (int c = 0; c < 4; ++c) {
        const auto node = static_cast<std::size_t>(model.tets(tet, c));
        if (std::exchange(seen[node], static_cast<std::int32_t>(t)) == static_cast<std::int32_t>(t)) continue;
        std::uint32_t& more = with[kind[node]];
        if (more == 0) more = ++kinds;
        kind[node] = more;
      }
    }
  }
  return kind;
}

float diagonal(const PointsF& points) {
  return (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
}

constexpr Eigen::Index kWorthThreads = 20'000;  // vertices; fewer are done before a thread wakes

template <class T>
T* data_or_null(std::vector<T>& rows) {
  return rows.empty() ? nullptr : rows.data();
}

}  // namespace

BodyParts::BodyParts(const Model& model)
    : clusters_(cluster_nodes(model, kinds_of_nodes(model))),
      tissues_(model.tissues.size()),
      origin_(middle_of(floats(model.nodes))),
      reach_(std::max(1.0F, diagonal(model.nodes))) {
  const auto build = [&](std::size_t t) {
    const Tissue& tissue = model.tissues[t];
    Part& part = tissues_[t];
    if (tissue.segment != Tissue::by_tets) {
      part.origin = middle_of(floats(tissue.V));
      part.normals = rest_normals(tissue);
      return;
    }
    part.groups = group_vertices(model, tissue, clusters_.lane);
    part.mask.assign((clusters_.clusters() + 63) / 64, 0);
    for (const std::uint32_t row : part.groups.rows) {
      const std::size_t cluster = row / (3 * NodeClusters::size);
      part.mask[cluster / 64] |= std::uint64_t{1} << cluster % 64;
    }
  };
  Eigen::Index vertices = 0;
  for (const Tissue& tissue : model.tissues) vertices += tissue.V.rows();
  if (vertices < kWorthThreads) {
    for (std::size_t t = 0; t < tissues_.size(); ++t) build(t);
  } else {
    tbb::parallel_for(std::size_t{0}, tissues_.size(), build);
  }
  for (std::size_t t = 0; t < tissues_.size(); ++t) {
    const bool bone = model.tissues[t].segment != Tissue::by_tets;
    const auto count =
        bone ? static_cast<std::size_t>(model.tissues[t].V.rows()) : tissues_[t].groups.cells.size();
    const std::size_t most = bone ? kBoneVerticesPerBlock : kCellsPerBlock;
    tissues_[t].first = static_cast<std::uint32_t>(blocks_.size());
    for (std::size_t i = 0; i < count; i += most) {
      blocks_.push_back({static_cast<std::uint32_t>(t), static_cast<std::uint32_t>(i),
                         static_cast<std::uint32_t>(std::min(count, i + most))});
    }
    tissues_[t].end = static_cast<std::uint32_t>(blocks_.size());
  }
}

void BodyParts::make_scratch(PosedBody::Scratch& scratch) const {
  scratch.lanes.assign(lane_floats(), 0.0F);
  scratch.mask.resize((clusters_.clusters() + 63) / 64);
  scratch.clusters.reserve(clusters_.clusters());
  scratch.blocks.reserve(blocks_.size());
}

void BodyParts::skin(Skinning skinning, std::span<const std::uint32_t> tissues, NodesOf nodes,
                     PosedBody& out) const {
  PosedBody::Scratch& scratch = out.scratch;
  const std::size_t count = clusters_.clusters();
  std::fill(scratch.mask.begin(), scratch.mask.end(),
            nodes == NodesOf::body ? ~std::uint64_t{0} : std::uint64_t{0});
  if (nodes == NodesOf::tissues) {
    for (const std::uint32_t t : tissues) {
      const std::vector<std::uint64_t>& mask = tissues_[t].mask;
      for (std::size_t w = 0; w < mask.size(); ++w) scratch.mask[w] |= mask[w];
    }
  }
  scratch.clusters.clear();
  for (std::size_t w = 0; w < scratch.mask.size(); ++w) {
    for (std::uint64_t bits = scratch.mask[w]; bits != 0; bits &= bits - 1) {
      const std::size_t cluster = 64 * w + static_cast<std::size_t>(std::countr_zero(bits));
      if (cluster < count) scratch.clusters.push_back(static_cast<std::uint32_t>(cluster));
    }
  }

  const RootMotion root = make_motions(out.segments, origin_, scratch.motions);
  for (std::size_t c = 0; c < 3; ++c) {
    out.box.low[c] = static_cast<float>(static_cast<double>(origin_[c] - reach_) + root.shift[c]);
  }
  out.box.step = 2 * reach_ / 65535;
  const SkinClusters job{clusters_,
                         scratch.motions,
                         root,
                         scratch.clusters,
                         std::span(scratch.lanes).first(3 * clusters_.node.size()),
                         nodes == NodesOf::body ? std::span<float>(out.nodes) : std::span<float>()};
  switch (skinning) {
    case Skinning::lbs:
      return job.lbs();
    case Skinning::dqs:
      return job.dqs();
    case Skinning::cor:
      return job.cor();
  }
}

void BodyParts::move_block(const Model& model, const Block& block, PosedBody& out) const {
  const std::size_t t = block.tissue;
  const Tissue& tissue = model.tissues[t];
  const VertexSink sink{data_or_null(out.tissues[t]), data_or_null(out.quantised[t]),
                        data_or_null(out.normals[t]), out.box};
  if (tissue.segment == Tissue::by_tets) {
    kernels::tissue({tissues_[t].groups, out.scratch.lanes, sink}, block.begin, block.end);
    return;
  }
  const RigidTransform& motion = out.segments[static_cast<std::size_t>(tissue.segment)];
  const RootMotion carried = make_motions({&motion, 1}, tissues_[t].origin, {});
  kernels::bone({floats(tissue.V), floats(tissues_[t].normals), carried, sink}, block.begin, block.end);
}

void BodyParts::move(const Model& model, std::span<const std::uint32_t> tissues, PosedBody& out) const {
  out.scratch.blocks.clear();
  for (const std::uint32_t t : tissues) {
    for (std::uint32_t b = tissues_[t].first; b < tissues_[t].end; ++b) out.scratch.blocks.push_back(b);
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, out.scratch.blocks.size(), 2), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      move_block(model, blocks_[out.scratch.blocks[i]], out);
    }
  });
}

}  // namespace ecorche::runtime
